//! Buffers' way into memory.

use crate::GpuError;
use std::sync::mpsc::channel;
use wgpu::{Buffer, BufferDescriptor, BufferUsages, CommandEncoderDescriptor, Device, MapMode, PollType, Queue};

/// The content of a buffer after all work so far, as numbers.
pub(crate) fn read<T: bytemuck::Pod>(device: &Device, queue: &Queue, buffer: &Buffer) -> Result<Vec<T>, GpuError> {
    let readable = device.create_buffer(&BufferDescriptor {
        label: Some("read"),
        size: buffer.size(),
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&CommandEncoderDescriptor { label: Some("read") });
    encoder.copy_buffer_to_buffer(buffer, 0, &readable, 0, buffer.size());
    let submission = queue.submit([encoder.finish()]);
    let (sender, told) = channel();
    readable.slice(..).map_async(MapMode::Read, move |result| {
        // Whoever does not wait any more does not want to know.
        sender.send(result).ok();
    });
    let failed = |what: &dyn std::fmt::Display| GpuError::Device(what.to_string());
    device.poll(PollType::Wait { submission_index: Some(submission), timeout: None }).map_err(|error| failed(&error))?;
    told.recv().map_err(|error| failed(&error))?.map_err(|error| failed(&error))?;
    let mapped = readable.slice(..).get_mapped_range();
    Ok(bytemuck::cast_slice(&mapped).to_vec())
}
