//! Every shader is parsed and validated without a GPU, and its structs have the sizes that the CPU gives them.

use super::layout::VertexLayout;
use super::moment::MOMENT_BYTES;
use super::multiview::layer_wgsl;
use super::pipelines::{CASTER_WGSL, Near, PipelineKey, SUBJECTS, StoneKind, Subject, relight_wgsl, sight_wgsl};
use super::texels::{TEXEL_MOMENT_BYTES, TEXEL_RELIGHT_WGSL, TEXELS_WGSL};
use super::view::VIEW_BYTES;
use crate::actors::shade::SHADE_BYTES;
use crate::detail::DETAIL_BYTES;
use crate::lamps::uniform::LAMPS_BYTES;
use crate::tonemap::{DisplayKey, ToneCurve};
use bevy::render::render_resource::TextureFormat;
use heliodon_bundle::LightLayout;
use naga::valid::{Capabilities, ValidationFlags, Validator};

pub(crate) fn compile(source: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(source).unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    // Half floats read as words: every WebGPU device does that. Triangles are numbered where the device can.
    // Both eyes are drawn at once where it can, too.
    let capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32
        | Capabilities::PRIMITIVE_INDEX
        | Capabilities::MULTIVIEW
        | Capabilities::MULTISAMPLED_SHADING;
    Validator::new(ValidationFlags::all(), capabilities)
        .validate(&module)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(source)));
    module
}

fn size_of_struct(module: &naga::Module, name: &str) -> Option<u32> {
    module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name)).and_then(|(_, ty)| match &ty.inner {
        naga::TypeInner::Struct { span, .. } => Some(*span),
        _ => None,
    })
}

/// Bind groups that a shader has, from the first to the last.
fn bound_groups(module: &naga::Module) -> u32 {
    let bindings = module.global_variables.iter().filter_map(|(_, variable)| variable.binding);
    bindings.map(|binding| binding.group + 1).max().unwrap_or_default()
}

#[test]
fn the_composing_shader_is_valid() {
    let module = compile(crate::display::COMPOSE_WGSL);
    assert_eq!(size_of_struct(&module, "Compose"), Some(crate::display::COMPOSE_BYTES as u32));
}

#[test]
fn the_light_shader_is_valid_for_every_layout() {
    for coefficients in [4, 9] {
        for channels in [1, 3] {
            for (sun_steps, sun_bounce_functions) in [(1, 0), (92, 3), (1024, 64)] {
                let layout = LightLayout { sun_steps, coefficients, channels, sun_bounce_functions };
                let module = compile(&VertexLayout(layout).light_wgsl());
                assert_eq!(size_of_struct(&module, "Moment"), Some(MOMENT_BYTES as u32));
            }
        }
    }
}

#[test]
fn the_colour_shaders_are_valid_for_every_target() {
    for subject in SUBJECTS {
        for curve in [ToneCurve::Clamp, ToneCurve::Filmic, ToneCurve::Linear] {
            for format in [TextureFormat::Rgba8UnormSrgb, TextureFormat::Rgba8Unorm, TextureFormat::Rgba16Float] {
                let key = PipelineKey::new(subject, curve, format, 1);
                assert_eq!(size_of_struct(&compile(&key.wgsl()), "View"), Some(VIEW_BYTES as u32));
                assert_eq!(size_of_struct(&compile(&key.both_eyes().wgsl()), "View"), Some(VIEW_BYTES as u32));
                if subject != Subject::Sky {
                    for near in [Near::Nothing, Near::Actors, Near::Lamps] {
                        compile(&key.near(near).detailed().both_eyes().wgsl());
                        let module = compile(&key.near(near).detailed().wgsl());
                        assert_eq!(size_of_struct(&module, "Detail"), Some(DETAIL_BYTES as u32));
                        assert!(bound_groups(&module) <= 4, "no more than portable devices have");
                    }
                    for near in [Near::Actors, Near::Lamps] {
                        let module = compile(&key.near(near).wgsl());
                        assert_eq!(size_of_struct(&module, "Shade"), Some(SHADE_BYTES as u32));
                        let lamps = (near == Near::Lamps).then_some(LAMPS_BYTES as u32);
                        assert_eq!(size_of_struct(&module, "Lamps"), lamps);
                    }
                }
            }
        }
    }
}

#[test]
fn the_shaders_of_what_is_worn_are_valid_for_every_target() {
    use crate::covering::uniform::{COVER_BYTES, COVERS_BYTES, OWN_BITS};
    const { assert!(crate::actors::shade::ACTORS < 1 << OWN_BITS) };
    let check = |key: PipelineKey| {
        for key in [key, key.both_eyes()] {
            let module = compile(&key.wgsl());
            assert_eq!(size_of_struct(&module, "Cover"), Some(COVER_BYTES as u32));
            assert_eq!(size_of_struct(&module, "Covers"), Some(COVERS_BYTES as u32));
            assert!(bound_groups(&module) <= 4, "no more than portable devices have");
        }
    };
    for subject in SUBJECTS.into_iter().filter(|&subject| subject != Subject::Sky) {
        for (curve, format) in
            [(ToneCurve::Clamp, TextureFormat::Rgba8UnormSrgb), (ToneCurve::Linear, TextureFormat::Rgba16Float)]
        {
            let key = PipelineKey::new(subject, curve, format, 4);
            for near in [Near::Nothing, Near::Actors, Near::Lamps] {
                check(key.near(near).covered());
                check(key.near(near).covered().detailed());
            }
            check(key.outlined());
        }
    }
    let sky = PipelineKey::new(Subject::Sky, ToneCurve::Clamp, TextureFormat::Rgba8Unorm, 1);
    assert_eq!(sky.covered(), sky, "the sky wears nothing");
}

#[test]
fn what_hands_an_eye_its_layer_is_valid() {
    for several_samples in [false, true] {
        compile(&layer_wgsl(several_samples));
    }
}

#[test]
fn what_lights_texels_is_valid() {
    let module = compile(&format!("{TEXELS_WGSL}{TEXEL_RELIGHT_WGSL}"));
    assert_eq!(size_of_struct(&module, "TexelMoment"), Some(TEXEL_MOMENT_BYTES as u32));
}

#[test]
fn a_panorama_is_read_as_it_is_written() {
    use heliodon_bundle::panorama::TOLERANCE;
    let stone = Subject::Stone { kind: StoneKind::Panorama, closed: false };
    let key = PipelineKey::new(stone, ToneCurve::Clamp, TextureFormat::Rgba8Unorm, 1);
    let wgsl = key.wgsl();
    assert!(wgsl.contains(&format!("PANORAMA_TOLERANCE: f32 = {TOLERANCE};")));
    assert_eq!(size_of_struct(&compile(&wgsl), "TexelMoment"), Some(TEXEL_MOMENT_BYTES as u32));
}

#[test]
fn what_draws_depth_and_makes_normals_is_valid() {
    compile(CASTER_WGSL);
    let layout = LightLayout { sun_steps: 92, coefficients: 4, channels: 1, sun_bounce_functions: 8 };
    compile(&VertexLayout(layout).normals_wgsl());
}

#[test]
fn the_shader_that_numbers_triangles_is_valid() {
    assert_eq!(size_of_struct(&compile(&sight_wgsl()), "View"), Some(VIEW_BYTES as u32));
}

#[test]
fn the_shader_that_lights_an_eye_at_rest_is_valid() {
    for curve in [ToneCurve::Clamp, ToneCurve::Filmic] {
        compile(&relight_wgsl(DisplayKey { curve, format: TextureFormat::Rgba8Unorm }));
    }
}

#[test]
fn the_shaders_of_the_air_are_valid_for_every_target() {
    use crate::over_stone::CAMERA_BYTES;
    use crate::particles::quad::QUAD_BYTES;
    use crate::particles::render::{MAP_BYTES, air_wgsl, compose_wgsl};
    for (samples, lamps) in [(1, false), (1, true), (4, true)] {
        let module = compile(&air_wgsl(samples, lamps));
        for (name, bytes) in [("Camera", CAMERA_BYTES), ("Quad", QUAD_BYTES), ("Map", MAP_BYTES)] {
            assert_eq!(size_of_struct(&module, name), Some(bytes as u32));
        }
        assert_eq!(size_of_struct(&module, "Lamps"), lamps.then_some(LAMPS_BYTES as u32));
        assert!(bound_groups(&module) <= 4, "no more than portable devices have");
    }
    for curve in [ToneCurve::Clamp, ToneCurve::Filmic, ToneCurve::Linear] {
        for format in [TextureFormat::Rgba8UnormSrgb, TextureFormat::Rgba8Unorm, TextureFormat::Rgba16Float] {
            for samples in [1, 4] {
                let module = compile(&compose_wgsl(DisplayKey { curve, format }, samples));
                assert!(bound_groups(&module) <= 4, "no more than portable devices have");
            }
        }
    }
}

#[test]
fn the_shaders_of_impostors_are_valid_for_every_target() {
    use crate::impostor::{Draws, ImpostorKey, KIND_BYTES, PERSON_BYTES};
    use crate::over_stone::CAMERA_BYTES;
    for (samples, steps, draws) in [(1, 0, Draws::Looks), (1, 3, Draws::Shadows), (4, 2, Draws::Solids)] {
        for (curve, format) in
            [(ToneCurve::Clamp, TextureFormat::Bgra8UnormSrgb), (ToneCurve::Linear, TextureFormat::Rgba16Float)]
        {
            let module = compile(&ImpostorKey { display: DisplayKey { curve, format }, samples, steps, draws }.wgsl());
            for (name, bytes) in [("Camera", CAMERA_BYTES), ("Person", PERSON_BYTES), ("Kind", KIND_BYTES)] {
                assert_eq!(size_of_struct(&module, name), Some(bytes as u32));
            }
            assert!(bound_groups(&module) <= 4, "no more than portable devices have");
        }
    }
}

#[test]
fn the_shaders_of_films_are_valid_for_every_target() {
    use crate::film::{FILM_BYTES, FilmKey, Step};
    use crate::over_stone::CAMERA_BYTES;
    for (samples, surface, straight) in [(1, false, false), (4, true, false), (4, false, true)] {
        for (curve, format) in
            [(ToneCurve::Clamp, TextureFormat::Bgra8UnormSrgb), (ToneCurve::Linear, TextureFormat::Rgba16Float)]
        {
            let display = DisplayKey { curve, format };
            let module = compile(&FilmKey { display, samples, surface, straight, step: Step::Over }.wgsl());
            for (name, bytes) in [("Camera", CAMERA_BYTES), ("Film", FILM_BYTES)] {
                assert_eq!(size_of_struct(&module, name), Some(bytes as u32));
            }
            assert!(bound_groups(&module) <= 4, "no more than portable devices have");
        }
    }
}
