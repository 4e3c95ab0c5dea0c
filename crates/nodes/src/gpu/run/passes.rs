//! How passes become dispatches: pipelines, bind groups, parameter structs, and bands of rows.

use std::sync::Arc;

use orograph_graph::{
    NodeError, Value,
    gpu::{Access, Bind, FIRST_SLOT, Over, Pass, Recorder, Role, Rows, ScratchId, Size, Slot, WORKGROUP},
};

use super::{
    super::{
        device::{Pipeline, Trouble},
        lock,
        memory::ANSWER,
    },
    Band, Command, Run,
    submit::{BUSY, FIRST_CELLS, UNIFORM_BYTES},
};

/// Rows in a binding begin at multiples of this many rows, so that offsets are aligned whatever the length of a row.
const ALIGNED_ROWS: u32 = 64;
/// Dispatches along an axis.
const MOST_GROUPS: u32 = 65_535;

impl Run<'_> {
    fn pipeline(&self, pass: &Pass<'_>) -> Result<Arc<Pipeline>, Trouble> {
        let Pass { shader, entry, .. } = *pass;
        let is_wide = matches!(pass.over, Over::Cells(_) | Over::Array(_));
        let key = (self.job.node.id, (shader.name, entry));
        if let Some(known) = lock(&self.gpu.pipelines).get(&key) {
            return known.clone().map_err(Trouble::Shader);
        }
        let made = self.gpu.memory.device.pipeline(self.job.node, shader, entry, is_wide).map(Arc::new);
        let kept = match &made {
            Ok(pipeline) => Ok(Arc::clone(pipeline)),
            Err(Trouble::Shader(why)) => Err(why.clone()),
            Err(_) => return made,
        };
        lock(&self.gpu.pipelines).insert(key, kept);
        made
    }

    /// The buffer of a slot, and whether it has a number for each cell.
    fn buffer(&self, pass: &Pass<'_>, slot: &Slot) -> Option<(&wgpu::Buffer, bool)> {
        let node = self.job.node;
        let input = |name: &str, plane: usize| {
            let at = node.inputs.iter().position(|input| input.name == name)?;
            match (&self.rasters[at], &self.small.numbers[at]) {
                (Some(resident), _) => Some((&resident.planes.get(plane)?.buffer, true)),
                (None, Some((_, block))) => Some((&block.buffer, false)),
                (None, None) => None,
            }
        };
        let output = |name: &str, plane: usize| {
            let planes = &self.outputs[node.output_index(name)?];
            Some((&planes.get(plane)?.buffer, true))
        };
        match (pass.bound(slot), slot.role) {
            (Some(Bind::Input(name, plane)), _) => input(name, plane),
            (Some(Bind::Output(name, plane)), _) => output(name, plane),
            (Some(Bind::Scratch(id)), _) => {
                self.scratch.get(id.0).map(|(size, block)| (&block.buffer, *size == Size::Cells))
            }
            (None, Role::Input(plane)) => input(slot.name, plane),
            (None, Role::Output(plane)) => output(slot.name, plane),
            (None, Role::Cells | Role::Words) => None,
        }
    }

    /// The bind group of a pass over a band, whose parameter struct has so many bytes.
    fn group(
        &mut self,
        pass: &Pass<'_>,
        layout: &wgpu::BindGroupLayout,
        band: &Band,
        params: u64,
    ) -> Result<wgpu::BindGroup, Trouble> {
        let line = 4 * u64::from(self.job.window.cells[0]);
        let bound: Vec<(wgpu::Buffer, u64, u64)> = pass
            .shader
            .slots
            .iter()
            .map(|slot| match self.buffer(pass, slot) {
                Some((buffer, true)) => (buffer.clone(), u64::from(band.first) * line, u64::from(band.rows) * line),
                Some((buffer, false)) => (buffer.clone(), 0, buffer.size()),
                None => {
                    let unused = &self.small.unused[usize::from(slot.access != Access::Read)].buffer;
                    (unused.clone(), 0, unused.size())
                }
            })
            .collect();
        let key = (pass.shader.name, bound);
        if let Some(group) = self.groups.get(&key) {
            return Ok(group.clone());
        }
        let device = &self.gpu.memory.device;
        let (_, bound) = &key;
        let part = |buffer, offset, size| {
            wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset, size: std::num::NonZero::new(size) })
        };
        let mut entries = vec![
            wgpu::BindGroupEntry { binding: 0, resource: part(&self.gpu.uniforms, 0, params) },
            wgpu::BindGroupEntry { binding: 1, resource: part(&self.small.fault.buffer, 0, 16) },
        ];
        entries.extend((FIRST_SLOT..).zip(bound).map(|(binding, (buffer, offset, size))| wgpu::BindGroupEntry {
            binding,
            resource: part(buffer, *offset, *size),
        }));
        let descriptor = wgpu::BindGroupDescriptor { label: Some(pass.shader.name), layout, entries: &entries };
        let group = device.caught(|| device.device.create_bind_group(&descriptor))?;
        self.groups.insert(key, group.clone());
        Ok(group)
    }

    /// Adds a dispatch, which is expected to take so many nanoseconds. Submits what is pending if it is enough, and waits if
    /// the device has enough to do. A dispatch of unknown speed is submitted alone.
    fn dispatch(
        &mut self,
        pass: &Pass<'_>,
        pipeline: &Arc<Pipeline>,
        band: &Band,
        groups: [u32; 3],
        (takes, alone): (f64, bool),
    ) -> Result<(), NodeError> {
        let expected: f64 = self.expected.values().sum();
        if alone || expected + takes > 1.25 * BUSY.as_nanos() as f64 {
            self.flush()?;
        }
        let words = pass.shader.params(&self.numbers, pass.values, [band.first, band.row]);
        let group = self.group(pass, &pipeline.layout, band, size_of_val(&words[..]) as u64);
        let group = group.map_err(|trouble| self.failed(trouble))?;
        let params = self.place(&words)?;
        self.pending.push(Command::Dispatch { pipeline: Arc::clone(pipeline), group, params, groups });
        *self.expected.entry((pass.shader.name, pass.entry)).or_default() += takes;
        if alone { self.flush() } else { self.send_enough() }
    }

    /// Puts the parameter struct of a command into the buffer of those of the next submit; returns its place.
    fn place(&mut self, words: &[u32]) -> Result<u32, NodeError> {
        let step = self.gpu.memory.device.limits.min_uniform_buffer_offset_alignment as usize / 4;
        let start = self.params.len().next_multiple_of(step);
        if 4 * (start + words.len()) as u64 > UNIFORM_BYTES {
            self.send()?;
            return self.place(words);
        }
        self.params.resize(start, 0);
        self.params.extend_from_slice(words);
        Ok(4 * start as u32)
    }

    /// Rows of a dispatch that fit a binding with the rows that their cells read.
    fn rows_of_binding(&self, rows: Rows) -> Result<u32, Trouble> {
        let limit = self.gpu.memory.device.limits.max_storage_buffer_binding_size;
        let [nx, ny] = self.job.window.cells;
        let line = 4 * u64::from(nx);
        let fitting = u32::try_from(limit / line).unwrap_or(u32::MAX);
        // kernels without rasters bind words alone, whose size is known when they are reserved
        if fitting >= ny || self.job.node.has_ports_on_host() {
            return Ok(ny);
        }
        match rows {
            // room for the alignment of the first row as well
            Rows::Around(around) if fitting > 2 * around + 2 * ALIGNED_ROWS => Ok(fitting - 2 * around - ALIGNED_ROWS),
            Rows::Around(_) | Rows::All => Err(Trouble::TooLarge(orograph_graph::bytes(line * u64::from(ny)))),
        }
    }

    /// Adds a pass over an array of invocations, such as one for each cell, as one or more dispatches. A workgroup has a tile
    /// of so many columns and rows of it. `fitting` rows of the raster fit a binding with those around them.
    fn divided(
        &mut self,
        pass: &Pass<'_>,
        pipeline: &Arc<Pipeline>,
        [nx, ny]: [u32; 2],
        [wide, high]: [u32; 2],
        (rows, fitting): (Rows, u32),
    ) -> Result<(), NodeError> {
        let name = (pass.shader.name, pass.entry);
        let (all, tiles) = (self.job.window.cells[1], ny.div_ceil(high));
        let of_row = f64::from(nx) * f64::from(high);
        let mut row = 0;
        while row < tiles {
            let known = lock(&self.gpu.rates).get(&name).copied();
            let busy = BUSY.as_nanos() as f64;
            let (most, rate) = known.map_or((FIRST_CELLS, busy / FIRST_CELLS), |rate| (busy / rate, rate));
            let count = ((most / of_row) as u32).clamp(1, MOST_GROUPS).min(tiles - row);
            let (count, first, end) = match rows {
                Rows::Around(around) if fitting < all => {
                    let count = count.min((fitting / high).max(1));
                    let first = (row * high).saturating_sub(around) / ALIGNED_ROWS * ALIGNED_ROWS;
                    (count, first, ((row + count) * high).saturating_add(around).min(all))
                }
                Rows::Around(_) | Rows::All => (count, 0, all),
            };
            let band = Band { first, rows: end - first, row };
            let takes = rate * of_row * f64::from(count);
            self.dispatch(pass, pipeline, &band, [nx.div_ceil(wide), count, 1], (takes, known.is_none()))?;
            row += count;
        }
        Ok(())
    }

    /// Replaces the contents of a buffer that no pending pass reads or writes.
    fn upload(&mut self, scratch: ScratchId, words: &[u32]) -> Result<(), NodeError> {
        let (device, buffer) = (&self.gpu.memory.device, &self.scratch[scratch.0].1.buffer);
        let written = device.caught(|| device.queue.write_buffer(buffer, 0, bytemuck::cast_slice(words)));
        written.map_err(|trouble| self.failed(trouble))
    }
}

impl Recorder for Run<'_> {
    fn scratch(&mut self, size: Size) -> Result<ScratchId, NodeError> {
        let bytes = match size {
            Size::Cells => 4 * self.job.window.len() as u64,
            Size::Words(words) => 4 * words.max(1) as u64,
        };
        // words are bound as a whole
        if matches!(size, Size::Words(_)) && bytes > self.gpu.memory.device.limits.max_storage_buffer_binding_size {
            return Err(self.failed(Trouble::TooLarge(orograph_graph::bytes(bytes))));
        }
        let block = self.gpu.memory.block(bytes).map_err(|trouble| self.failed(trouble))?;
        if self.gpu.poison {
            let (device, nan) = (&self.gpu.memory.device, vec![0xff; block.buffer.size() as usize]);
            let written = device.caught(|| device.queue.write_buffer(&block.buffer, 0, &nan));
            written.map_err(|trouble| self.failed(trouble))?;
        }
        self.scratch.push((size, block));
        Ok(ScratchId(self.scratch.len() - 1))
    }

    fn table(&mut self, words: &[u32]) -> Result<ScratchId, NodeError> {
        let id = self.scratch(Size::Words(words.len()))?;
        // no pass so far has it
        self.upload(id, words).map(|()| id)
    }

    fn write(&mut self, scratch: ScratchId, words: &[u32]) -> Result<(), NodeError> {
        // what is written arrives after what was submitted, and before the next submit
        if !self.pending.is_empty() {
            self.send()?;
        }
        self.upload(scratch, words)
    }

    fn clear(&mut self, scratch: ScratchId) -> Result<(), NodeError> {
        let buffer = self.scratch[scratch.0].1.buffer.clone();
        self.pending.push(Command::Clear(buffer));
        self.send_enough()
    }

    fn pass(&mut self, pass: &Pass<'_>) -> Result<(), NodeError> {
        self.job.check()?;
        let pipeline = self.pipeline(pass).map_err(|trouble| self.failed(trouble))?;
        match pass.over {
            Over::Cells(rows) => {
                let fitting = self.rows_of_binding(rows).map_err(|trouble| self.failed(trouble))?;
                self.divided(pass, &pipeline, self.job.window.cells, [pipeline.workgroup, 1], (rows, fitting))
            }
            Over::Array(places) => {
                let fitting = self.rows_of_binding(Rows::All).map_err(|trouble| self.failed(trouble))?;
                self.divided(pass, &pipeline, places, [pipeline.workgroup, 1], (Rows::All, fitting))
            }
            Over::Tiles(tile, rows) => {
                let fitting = self.rows_of_binding(rows).map_err(|trouble| self.failed(trouble))?;
                self.divided(pass, &pipeline, self.job.window.cells, tile, (rows, fitting))
            }
            Over::Groups(groups) => {
                let ny = self.job.window.cells[1];
                self.rows_of_binding(Rows::All).map_err(|trouble| self.failed(trouble))?;
                let name = (pass.shader.name, pass.entry);
                let cells = groups.iter().map(|count| f64::from(*count)).product::<f64>() * f64::from(WORKGROUP);
                let known = lock(&self.gpu.rates).get(&name).copied();
                let takes = known.unwrap_or(BUSY.as_nanos() as f64 / FIRST_CELLS) * cells;
                let band = Band { first: 0, rows: ny, row: 0 };
                self.dispatch(pass, &pipeline, &band, groups, (takes, known.is_none()))
            }
        }
    }

    fn read(&mut self, scratch: ScratchId, words: usize) -> Result<Vec<u32>, NodeError> {
        let (buffer, bytes) = (self.scratch[scratch.0].1.buffer.clone(), 4 * words as u64);
        let mut read = Vec::with_capacity(words);
        let mut take = |bytes: &[u8]| {
            read.extend(bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)));
        };
        if bytes <= ANSWER {
            take(&self.wait(Some((&buffer, bytes)))?);
        } else {
            self.flush()?;
            self.gpu.memory.read(&buffer, bytes, take).map_err(|trouble| self.failed(trouble))?;
        }
        Ok(read)
    }

    fn give(&mut self, output: &'static str, value: Value) {
        self.given.push((output, value));
    }
}
