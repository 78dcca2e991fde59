//! A uniform that is made once and written in every frame.

use bevy::render::render_resource::{BindGroup, BindGroupEntries, BindGroupLayout, Buffer, BufferDescriptor, BufferUsages};
use bevy::render::renderer::{RenderDevice, RenderQueue};

/// Creates the uniform's buffer at the first call, with another one beside it if there is to be one, and writes it.
pub(super) fn write_uniform(
    slot: &mut Option<(Buffer, BindGroup)>,
    (device, queue): (&RenderDevice, &RenderQueue),
    layout: &BindGroupLayout,
    bytes: &[u8],
    beside: Option<&Buffer>,
    label: &'static str,
) {
    let (buffer, _) = slot.get_or_insert_with(|| {
        let buffer = device.create_buffer(&BufferDescriptor {
            label: Some(label),
            size: bytes.len() as u64,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let own = buffer.as_entire_binding();
        let group = match beside {
            None => device.create_bind_group(label, layout, &BindGroupEntries::single(own)),
            Some(other) => {
                device.create_bind_group(label, layout, &BindGroupEntries::sequential((own, other.as_entire_binding())))
            }
        };
        (buffer, group)
    });
    queue.write_buffer(buffer, 0, bytes);
}
