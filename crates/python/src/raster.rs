//! A raster of a run. Its samples stay where the evaluator has put them; NumPy reads them in place.

use std::path::PathBuf;

use orograph::export::picture::{self, View};
use orograph_graph::{Field, PortType};
use orograph_nodes::raster;
use pyo3::{exceptions::PyOSError, prelude::*, types::PyDict};

/// A raster with the samples of an output.
#[pyclass(frozen, module = "orograph._orograph")]
pub struct Raster {
    field: Field,
    ty: PortType,
}

impl Raster {
    /// The raster of an output of this type.
    pub const fn new(field: Field, ty: PortType) -> Self {
        Self { field, ty }
    }

    /// The shape of an array with its samples: rows and columns, after planes if there are several.
    fn shape(&self) -> Vec<usize> {
        let [nx, ny] = self.field.window().cells.map(|count| count as usize);
        let planes = self.field.planes();
        if planes == 1 { vec![ny, nx] } else { vec![planes, ny, nx] }
    }
}

#[pymethods]
impl Raster {
    /// How NumPy reads the samples: in place, and without the right to write, because later runs reuse them.
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("typestr", if cfg!(target_endian = "big") { ">f4" } else { "<f4" })?;
        interface.set_item("shape", pyo3::types::PyTuple::new(py, self.shape())?)?;
        interface.set_item("data", (self.address(), true))?;
        Ok(interface)
    }

    /// The address of the first sample.
    #[getter]
    fn address(&self) -> usize {
        self.field.samples().as_ptr().addr()
    }

    /// `height`, `mask`, `scalar`, `vector`, `colour`, `normal` or `weights`.
    #[getter]
    fn kind(&self) -> String {
        let text = self.ty.to_string();
        text.split(' ').next().unwrap_or_default().to_owned()
    }

    /// The symbol of the unit; empty for plain numbers.
    #[getter]
    fn unit(&self) -> &'static str {
        self.ty.unit().symbol()
    }

    /// Side of a cell in metres.
    #[getter]
    fn cell_m(&self) -> f64 {
        self.field.window().cell_m()
    }

    /// Column and row of the first cell in the world.
    #[getter]
    fn origin(&self) -> [u32; 2] {
        self.field.window().origin
    }

    /// EPSG code, and easting and northing of the north-west corner; None for a world without a place.
    #[getter]
    fn place(&self) -> Option<(u32, [f64; 2])> {
        self.field.window().place().map(|place| (place.epsg, place.corner_m))
    }

    /// Writes a picture: heights as a map, colours as they are, other numbers from black to white.
    fn write_png(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| {
            let picture = picture::of_field(&self.field, self.ty, View::Map);
            raster::write_colour(&path, &picture, &|| true)
        })
        .map_err(|error| PyOSError::new_err(error.to_string()))
    }
}
