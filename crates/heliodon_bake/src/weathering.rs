//! Weathering of a scene ([`heliodon_lightmap::weathering`]): what the weather has left at its vertices and texels, and how that changes the albedo of its parts.
//!
//! Amounts are solved for the whole scene where any part is weathered, for strengths and colours change no ray; they are kept by a name of their own, so that light is never solved anew for
//! the weather's sake, nor the weather for the light's. A shard does nothing of it: a merge asks for all.

use crate::blocks::{block_ranges, points_per_block};
use crate::codec::{Decoder, Encoder};
use crate::error::BakeError;
use crate::key::{Digest, TOOL};
use crate::light::LightInput;
use crate::names::SceneDigests;
use crate::stages::Work;
use crate::texels::{Atlas, weather_texels};
use glam::{DVec3, Vec3};
use heliodon_bundle::site::{Site, Weathering};
use heliodon_light::{PointSet, Validity};
use heliodon_lightmap::weathering::{Amounts, Climate, Look, weather};
use heliodon_math::color::linear_from_srgb8_table;
use heliodon_mesh::Mesh;
use heliodon_rays::TriangleScene;
use std::ops::Range;

/// How the parts of a site are weathered.
#[derive(Clone, Debug, PartialEq)]
pub struct WeatherPlan {
    /// The weather.
    pub climate: Climate,
    /// How each part shows it; none where it does not.
    pub looks: Vec<Option<Look>>,
}

/// What its blocks are called.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WeatherNames {
    /// At vertices.
    pub vertices: String,
    /// In texels, where there are any.
    pub texels: Option<String>,
}

/// What the weather has left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BakedWeathering {
    /// At each vertex of the scene.
    pub vertices: Vec<Amounts>,
    /// At each texel of the atlas's level for it; empty where no weathered part is lit by texels.
    pub texels: Vec<Amounts>,
}

impl WeatherPlan {
    /// That of a site; none where no part shows any.
    #[must_use]
    pub fn new(site: &Site) -> Option<Self> {
        let whole = site.weathering.as_ref()?;
        let look = |own: Weathering| Look {
            dust: own.dust as f32,
            corrosion: own.corrosion as f32,
            dust_color: DVec3::from(own.dust_color).as_vec3(),
            corrosion_color: DVec3::from(own.corrosion_color).as_vec3(),
        };
        let looks: Vec<Option<Look>> =
            site.parts.iter().map(|part| whole.of_part(part.weathering.as_ref()).map(look)).collect();
        let in_model = |bearing_deg: f64| (bearing_deg - site.site.north_deg).to_radians();
        let climate = Climate {
            wind_from_rad: whole.wind_from_deg.map(in_model),
            wind_m_per_s: whole.wind_m_per_s,
            ..Climate::default()
        };
        looks.iter().any(Option::is_some).then_some(Self { climate, looks })
    }

    /// The atlas, if any weathered part is lit by it.
    fn in_texels<'a>(&self, atlas: Option<&'a Atlas>) -> Option<&'a Atlas> {
        atlas.filter(|atlas| self.looks.iter().enumerate().any(|(part, look)| look.is_some() && atlas.of_part(part).is_some()))
    }

    /// What the blocks are called of some geometry whose rays start `offset_m` off its surface.
    #[must_use]
    pub fn names(&self, scene: &SceneDigests, offset_m: f32, atlas: Option<&Atlas>) -> WeatherNames {
        let Climate { wind_from_rad, wind_m_per_s, directions } = self.climate;
        let mut digest = Digest::default();
        digest.run(TOOL.as_bytes());
        digest.run(&scene.geometry);
        digest.run(format!("{offset_m:?} {wind_from_rad:?} {wind_m_per_s:?} {directions}").as_bytes());
        let of_atlas = |atlas: &Atlas| {
            let mut digest = digest.clone();
            digest.run(&atlas.digest());
            format!("texel-weather-{}", digest.digits())
        };
        WeatherNames { vertices: format!("weather-{}", digest.digits()), texels: self.in_texels(atlas).map(of_atlas) }
    }
}

impl WeatherNames {
    /// All of them.
    #[must_use]
    pub fn all(&self) -> Vec<String> {
        [Some(self.vertices.clone()), self.texels.clone()].into_iter().flatten().collect()
    }
}

/// Solves what the weather has left; vertices that lie inside something show what those have from which they borrow their light.
///
/// # Errors
/// A climate that the solver refuses, a cache that cannot be written.
pub fn bake_weathering(
    (plan, names): (&WeatherPlan, &WeatherNames),
    input: &LightInput,
    validity: &Validity,
    work: &Work,
) -> Result<BakedWeathering, BakeError> {
    let (surfaces, params) = (&input.surfaces, input.params);
    let points = PointSet::at_vertices(surfaces, params.offset_m);
    let of_points = at_points(&points, surfaces.rays, &plan.climate, work, (&names.vertices, "weather"))?;
    let mut own = vec![Amounts::default(); surfaces.positions.len()];
    for (&site, amounts) in points.sites.iter().zip(of_points) {
        own[site as usize] = amounts;
    }
    // what borrows from a cell within a triangle shows nothing: all its neighbours are inside something, too
    let shown = |&source: &u32| own.get(source as usize).copied().unwrap_or_default();
    let vertices = validity.source.iter().map(shown).collect();
    let texels = match (&names.texels, input.texels) {
        (Some(name), Some(of)) => weather_texels(&plan.climate, input, of, work, name)?,
        _ => Vec::new(),
    };
    Ok(BakedWeathering { vertices, texels })
}

/// Rays of a place count half: that many of all directions stand above its surface.
const OF_DIRECTIONS: u64 = 2;

/// What the weather leaves at points, in their order, in blocks that are kept.
pub(crate) fn at_points(
    points: &PointSet,
    rays: &TriangleScene,
    climate: &Climate,
    work: &Work,
    (name, told): (&str, &str),
) -> Result<Vec<Amounts>, BakeError> {
    let per_block = points_per_block(points.len(), u64::from(climate.directions) / OF_DIRECTIONS);
    let ranges: Vec<Range<usize>> = block_ranges(0..points.len(), per_block).collect();
    let blocks = work.stage(name, told).run(
        &ranges,
        0,
        |bytes, range| decode(bytes).filter(|block| block.len() == range.len()),
        |range| Ok::<_, BakeError>(weather(rays, &points.origins[range.clone()], &points.normals[range], climate)?),
        |block| encode(block),
    )?;
    Ok(blocks.concat())
}

fn encode(block: &[Amounts]) -> Vec<u8> {
    let flat: Vec<f32> = block.iter().flat_map(|amounts| [amounts.dust, amounts.corrosion]).collect();
    let mut encoder = Encoder::default();
    encoder.run(&flat);
    encoder.finish()
}

fn decode(bytes: &[u8]) -> Option<Vec<Amounts>> {
    let mut decoder = Decoder::new(bytes);
    let flat: Vec<f32> = decoder.run()?;
    let (pairs, rest) = flat.as_chunks();
    let fits = rest.is_empty() && decoder.is_empty() && flat.iter().all(|amount| (0.0..=1.0).contains(amount));
    fits.then(|| pairs.iter().map(|&[dust, corrosion]| Amounts { dust, corrosion }).collect())
}

/// The weathered albedo of vertices.
pub struct WeatheredAlbedo<'a> {
    plan: &'a WeatherPlan,
    amounts: &'a [Amounts],
    /// Of each material the mean colour of its texture.
    means: Vec<Option<Vec3>>,
}

impl<'a> WeatheredAlbedo<'a> {
    /// Of a mesh at whose vertices the weather has left these amounts.
    #[must_use]
    pub fn new(plan: &'a WeatherPlan, baked: &'a BakedWeathering, mesh: &Mesh) -> Self {
        let mean = |material: &heliodon_mesh::Material| material.texture.as_ref().map(|t| mean_color(&t.image.pixels));
        Self { plan, amounts: &baked.vertices, means: mesh.materials.iter().map(mean).collect() }
    }

    /// The albedo of a part's vertex, the factor of its texture where it has one, in place of `albedo`.
    #[must_use]
    pub fn of(&self, part: usize, vertex: usize, material: Option<u16>, albedo: Vec3) -> Vec3 {
        let Some(look) = &self.plan.looks[part] else { return albedo };
        let layer = look.layer(self.amounts[vertex]);
        let mean = material.and_then(|material| self.means.get(usize::from(material)).copied().flatten());
        match mean {
            None => layer.over(albedo).clamp(Vec3::ZERO, Vec3::ONE),
            Some(mean) => layer.factor(albedo, mean),
        }
    }
}

/// The mean of an image's pixels, linear.
fn mean_color(pixels: &[[u8; 4]]) -> Vec3 {
    let linear = linear_from_srgb8_table();
    let of = |pixel: &[u8; 4]| DVec3::from([0, 1, 2].map(|channel| f64::from(linear[usize::from(pixel[channel])])));
    (pixels.iter().map(of).sum::<DVec3>() / pixels.len().max(1) as f64).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(weathering: &str, part: &str, north: &str) -> Option<WeatherPlan> {
        let text = format!(
            "[site]\nname = \"a\"\n{north}\n[[part]]\nfile = \"a.ply\"\n{part}\n[[part]]\nfile = \"b.ply\"\n[sky]\n\
             probes = \"a.hdr\"\nmapping = \"lat-long\"\n{weathering}\n"
        );
        WeatherPlan::new(&Site::parse(&text, "site.toml").unwrap())
    }

    #[test]
    fn it_is_off_unless_a_part_shows_it() {
        assert_eq!(plan("", "", ""), None);
        assert_eq!(plan("[weathering]", "", ""), None);
        let one = plan("[weathering]", "weathering = { dust = 0.5 }", "").unwrap();
        assert!(one.looks[0].is_some() && one.looks[1].is_none());
        let other = plan("[weathering]\ncorrosion = 0.5", "weathering = false", "").unwrap();
        assert!(other.looks[0].is_none() && other.looks[1].is_some());
        assert_eq!(other.climate, Climate::default());
    }

    #[test]
    fn winds_come_from_where_the_compass_says() {
        // the model's -Z looks east, so what comes from the east comes from -Z
        let turned = plan("[weathering]\ndust = 1.0\nwind_from_deg = 90.0", "", "north_deg = 90.0").unwrap();
        assert_eq!(turned.climate.wind_from_rad, Some(0.0));
    }

    #[test]
    fn names_are_of_what_decides_the_amounts() {
        let names = |text: &str, geometry: u8, offset_m: f32| {
            let scene = SceneDigests { geometry: [geometry; 32], albedo: [0; 32] };
            plan(text, "", "").unwrap().names(&scene, offset_m, None)
        };
        let first = names("[weathering]\ndust = 1.0", 1, 0.5);
        assert_eq!(first.texels, None);
        assert_eq!(names("[weathering]\ncorrosion = 0.2\ndust_color = [0, 0, 0]", 1, 0.5), first, "a look asks no ray again");
        assert_ne!(names("[weathering]\ndust = 1.0\nwind_m_per_s = 3", 1, 0.5), first);
        assert_ne!(names("[weathering]\ndust = 1.0\nwind_from_deg = 0", 1, 0.5), first);
        assert_ne!(names("[weathering]\ndust = 1.0", 2, 0.5), first);
        assert_ne!(names("[weathering]\ndust = 1.0", 1, 0.25), first);
    }

    #[test]
    fn blocks_are_read_as_they_were_written_and_nothing_else() {
        let block = [Amounts { dust: 0.25, corrosion: 1.0 }, Amounts::default()];
        assert_eq!(decode(&encode(&block)).unwrap(), block);
        assert_eq!(decode(&encode(&[Amounts { dust: 1.5, corrosion: 0.0 }])), None);
        assert_eq!(decode(&encode(&[Amounts { dust: f32::NAN, corrosion: 0.0 }])), None);
        assert_eq!(decode(&[7]), None);
    }

    #[test]
    fn means_are_linear() {
        let mean = mean_color(&[[0, 255, 188, 0], [255, 255, 188, 255]]);
        assert!(mean.abs_diff_eq(Vec3::new(0.5, 1.0, 0.503), 1e-3), "{mean}");
    }
}
