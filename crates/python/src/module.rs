//! The module as Python imports it.

#[pyo3::pymodule]
mod _orograph {
    use pyo3::prelude::*;

    use crate::errors;
    #[pymodule_export]
    use crate::graph::Graph;
    #[pymodule_export]
    use crate::raster::Raster;
    #[pymodule_export]
    use crate::session::configure;

    /// The declarations of all nodes, as JSON.
    #[pyfunction]
    fn nodes(py: Python<'_>) -> PyResult<String> {
        orograph::cli::nodes_json(&orograph_nodes::registry()).map_err(|failure| errors::of_failure(py, &failure))
    }

    /// The JSON Schema of graph files.
    #[pyfunction]
    fn schema() -> String {
        orograph::cli::schema(&orograph_nodes::registry()).to_string()
    }
}
