//! Buffers, shaders and dispatches.

use crate::GpuError;
use glam::Vec3;
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{
    BindGroupEntry, Buffer, BufferDescriptor, BufferUsages, ComputePipeline, ComputePipelineDescriptor, Device, ShaderModule,
    ShaderModuleDescriptor, ShaderSource,
};

/// Points of a workgroup.
const WORKGROUP: u32 = 64;
/// Workgroups that a dispatch may have along one axis, by wgpu's default limits.
pub(crate) const MOST_WORKGROUPS: u32 = 65_535;

/// As storage buffers have vectors.
pub(crate) fn padded(vectors: &[Vec3]) -> Vec<[f32; 4]> {
    vectors.iter().map(|v| v.extend(0.0).to_array()).collect()
}

/// A buffer with this in it; an empty binding is none, so it has something.
pub(crate) fn filled(device: &Device, label: &str, contents: &[u8], usage: BufferUsages) -> Buffer {
    let contents = if contents.is_empty() { &[0; 64] } else { contents };
    device.create_buffer_init(&BufferInitDescriptor { label: Some(label), contents, usage })
}

/// A buffer that shaders read, and that can be written.
pub(crate) fn storage(device: &Device, label: &str, contents: &[u8]) -> Buffer {
    filled(device, label, contents, BufferUsages::STORAGE | BufferUsages::COPY_DST)
}

/// A buffer of zeros.
pub(crate) fn empty(device: &Device, label: &str, bytes: u64, usage: BufferUsages) -> Buffer {
    device.create_buffer(&BufferDescriptor { label: Some(label), size: bytes.max(16), usage, mapped_at_creation: false })
}

/// A buffer of constants.
pub(crate) fn uniform(device: &Device, contents: &[u8]) -> Buffer {
    filled(device, "uniform", contents, BufferUsages::UNIFORM)
}

/// Bindings from 0 on.
pub(crate) fn entries<'a>(buffers: &[&'a Buffer]) -> Vec<BindGroupEntry<'a>> {
    let entry = |(binding, buffer): (u32, &&'a Buffer)| BindGroupEntry { binding, resource: buffer.as_entire_binding() };
    (0..).zip(buffers).map(entry).collect()
}

/// A shader.
pub(crate) fn shader(device: &Device, label: &str, source: &str) -> ShaderModule {
    device.create_shader_module(ShaderModuleDescriptor { label: Some(label), source: ShaderSource::Wgsl(source.into()) })
}

/// A pipeline of one of a module's functions.
pub(crate) fn compute(device: &Device, module: &ShaderModule, entry: &str) -> ComputePipeline {
    device.create_compute_pipeline(&ComputePipelineDescriptor {
        label: Some(entry),
        layout: None,
        module,
        entry_point: Some(entry),
        compilation_options: Default::default(),
        cache: None,
    })
}

/// Workgroups for so many points, along two axes.
pub(crate) fn workgroups(points: u32) -> [u32; 2] {
    let groups = points.div_ceil(WORKGROUP).max(1);
    let row = groups.min(MOST_WORKGROUPS);
    [row, groups.div_ceil(row)]
}

/// # Errors
/// More bytes than a binding of the device holds.
pub(crate) fn fits(device: &Device, what: &'static str, needed_bytes: u64, remedy: &'static str) -> Result<(), GpuError> {
    let limits = device.limits();
    let most_bytes = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
    if needed_bytes > most_bytes {
        return Err(GpuError::TooLarge { what, needed_bytes, most_bytes, remedy });
    }
    Ok(())
}

/// What the tests of shaders share.
#[cfg(test)]
pub(crate) mod testing {
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    /// Asserts that a shader is valid without a GPU, and that its structs have the sizes that they have here.
    pub fn assert_valid(label: &str, source: &str, sizes: &[(&str, usize)]) {
        let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|e| panic!("{label}: {}", e.emit_to_string(source)));
        // Half floats in pairs are WebGPU's own; only old OpenGL has none.
        Validator::new(ValidationFlags::all(), Capabilities::SHADER_FLOAT16_IN_FLOAT32)
            .validate(&module)
            .unwrap_or_else(|error| panic!("{label}: {}", error.emit_to_string(source)));
        for (name, size) in sizes {
            let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).map(|(_, ty)| &ty.inner);
            let Some(naga::TypeInner::Struct { span, .. }) = found else { panic!("{label} has no {name}") };
            assert_eq!((*span as usize).next_multiple_of(16), *size, "{label}: {name}");
        }
        let storage = module.global_variables.iter().filter(|(_, v)| matches!(v.space, naga::AddressSpace::Storage { .. }));
        assert!(storage.count() <= 8, "{label}: more storage buffers than every device has");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dispatches_stay_within_the_limits() {
        for (points, expected) in
            [(0, [1, 1]), (64, [1, 1]), (65, [2, 1]), (64 * 65_535, [65_535, 1]), (64 * 65_535 + 1, [65_535, 2])]
        {
            assert_eq!(workgroups(points), expected);
        }
    }
}
