//! The reference picture: the path tracer over a bundle's geometry, albedo, sky map and sun, with nothing of its baked light.

use anyhow::{Context, Result, bail};
use glam::{Vec2, Vec3};
use heliodon_bundle::lineage::Prepared;
use heliodon_bundle::moment::{Blend, Day, Moment};
use heliodon_bundle::{BundleReader, LitChunk};
use heliodon_image::{HdrImage, SrgbImage, TextureWrap};
use heliodon_light::reference::{Camera, DirectSun, LatLongSky, ReferenceFrame, ReferenceParams, Shape, render, render_shape};
use heliodon_light::{SurfaceAlbedo, Surfaces};
use heliodon_rays::{BuildParams, TriangleScene};
use heliodon_sky::mapping::Mapping;
use heliodon_sky::probe::Probe;
use heliodon_sky::sun::{FoundSun, SunParams, find_sun};
use heliodon_view::navigation::pose::fov_deg;

/// A bundle made ready for the path tracer.
pub struct ReferenceStage {
    rays: TriangleScene,
    geometry: Geometry,
    params: ReferenceParams,
    shape: Option<SeenShape>,
}

/// Another bundle's geometry, seen in place of the one that light travels through.
struct SeenShape {
    rays: TriangleScene,
    geometry: Geometry,
    /// For each of its triangles, as [`Shape::reach_rad`].
    reach_rad: Vec<f32>,
}

#[derive(Default)]
struct Geometry {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    albedo: Vec<Vec3>,
    /// As long as the others where any part has a texture, else empty.
    uvs: Vec<Vec2>,
    /// First triangle of each run with the same texture.
    texture_runs: Vec<(usize, Option<u32>)>,
    textures: Vec<(SrgbImage, [TextureWrap; 2])>,
}

impl Geometry {
    fn push(&mut self, chunk: &LitChunk) {
        let first = self.positions.len() as u32;
        if chunk.texture.is_some() {
            self.uvs.resize(self.positions.len(), Vec2::ZERO);
            self.uvs.extend(&chunk.uvs);
        }
        self.texture_runs.push((self.triangles.len(), chunk.texture));
        self.positions.extend(&chunk.positions);
        self.normals.extend(&chunk.normals);
        self.albedo.extend(&chunk.albedo);
        self.triangles.extend(chunk.triangles.iter().map(|triangle| triangle.map(|index| first + index)));
    }

    fn rays(&self) -> Result<TriangleScene> {
        Ok(TriangleScene::build(&self.positions, &self.triangles, &BuildParams::default())?)
    }

    fn surfaces<'a>(&'a self, rays: &'a TriangleScene) -> Surfaces<'a> {
        Surfaces {
            rays,
            positions: &self.positions,
            normals: &self.normals,
            triangles: &self.triangles,
            albedo: self,
            detail: None,
        }
    }

    fn texture_of(&self, triangle: u32) -> Option<&(SrgbImage, [TextureWrap; 2])> {
        let after = self.texture_runs.partition_point(|(first, _)| *first <= triangle as usize);
        let (_, texture) = self.texture_runs.get(after.checked_sub(1)?)?;
        self.textures.get(texture.as_ref().copied()? as usize)
    }
}

impl SurfaceAlbedo for Geometry {
    fn albedo(&self, triangle: u32, u: f32, v: f32) -> Vec3 {
        let corners = self.triangles[triangle as usize].map(|index| index as usize);
        let weights = [1.0 - u - v, u, v];
        let factor: Vec3 = corners.iter().zip(weights).map(|(&corner, weight)| self.albedo[corner] * weight).sum();
        let Some((texture, wrap)) = self.texture_of(triangle) else { return factor };
        let uv: Vec2 = corners.iter().zip(weights).map(|(&corner, weight)| self.uvs[corner] * weight).sum();
        factor * texture.sample_bilinear(uv.x, uv.y, *wrap).truncate()
    }

    fn mean(&self, triangle: u32) -> Vec3 {
        const THIRD: f32 = 1.0 / 3.0;
        self.albedo(triangle, THIRD, THIRD)
    }
}

impl ReferenceStage {
    /// Reads a bundle's geometry; `samples` paths a pixel, as many bounces as were baked.
    ///
    /// # Errors
    /// If the bundle cannot be read.
    pub fn new(bundle: &BundleReader, samples: u32) -> Result<Self> {
        let mut geometry = Geometry::default();
        for index in 0..bundle.manifest().textures.len() {
            let name = &bundle.manifest().textures[index].name;
            let image = SrgbImage::from_bytes(&bundle.texture_bytes(index)?, name)?;
            geometry.textures.push((image, bundle.texture_wrap(index)));
        }
        for index in 0..bundle.chunk_count() {
            geometry.push(&bundle.read_chunk(index)?);
        }
        if !geometry.uvs.is_empty() {
            geometry.uvs.resize(geometry.positions.len(), Vec2::ZERO);
        }
        let rays = geometry.rays()?;
        let params = ReferenceParams {
            samples,
            max_bounces: bundle.manifest().parameters.bake.bounces,
            offset_m: bundle.manifest().offset_m as f32,
            seed: 0,
        };
        Ok(Self { rays, geometry, params, shape: None })
    }

    /// Has the geometry of `prepared` seen in place of `bundle`'s, which this is of, wherever it may be off what it stands for by no more than was measured.
    ///
    /// # Errors
    /// If the bundle cannot be read, has another origin, or its preparation did not measure how far it is off as seen from a room.
    pub fn show_shape_of(&mut self, prepared: &BundleReader, bundle: &BundleReader) -> Result<()> {
        let manifest = prepared.manifest();
        let Some(Prepared { parts, .. }) = &manifest.prepared else {
            bail!("it was not prepared, so that nobody knows how far it is off; give its site a [prepare]")
        };
        if manifest.rooms.is_empty() {
            bail!(
                "it was prepared for no room, from which it would be known how far it is off in pixels; give its site a [[room]]"
            )
        }
        let (own, other) = (bundle.manifest().site.origin, manifest.site.origin);
        if own != other {
            bail!("its origin is {other:?}, and {own:?} of what light travels through; give both sites the same")
        }
        let (mut geometry, mut reach_rad) = (Geometry::default(), Vec::new());
        for index in 0..prepared.chunk_count() {
            let chunk = prepared.read_chunk(index)?;
            let Some(error) = parts.get(usize::from(chunk.part)).and_then(|part| part.error) else {
                bail!("when it was prepared nobody measured how far it is off; prepare and bake it again")
            };
            geometry.push(&chunk);
            reach_rad.resize(geometry.triangles.len(), angle_rad(error.max_px, fov_deg(manifest), manifest.display.height_px));
        }
        self.shape = Some(SeenShape { rays: geometry.rays()?, geometry, reach_rad });
        Ok(())
    }

    /// The picture at a moment: linear radiance, the sky behind the stone.
    ///
    /// # Errors
    /// If a sky map cannot be read.
    pub fn render(&self, bundle: &BundleReader, moment: &Moment, camera: &Camera) -> Result<ReferenceFrame> {
        let surfaces = self.geometry.surfaces(&self.rays);
        let map = sky_without_sun(bundle, moment)?;
        let sky = LatLongSky::new(map.width, map.height, map.pixels)?;
        let sun = (moment.sun_irradiance.max_element() > 0.0)
            .then_some(DirectSun { direction: moment.sun_direction, irradiance: moment.sun_irradiance });
        let Some(shape) = &self.shape else { return Ok(render(&surfaces, &sky, sun, camera, &self.params)?) };
        let seen = shape.geometry.surfaces(&shape.rays);
        let shape = Shape { surfaces: &seen, reach_rad: &shape.reach_rad };
        Ok(render_shape(shape, &surfaces, &sky, sun, camera, &self.params)?)
    }
}

/// The angle, in radians, of so many pixels in the middle of a display of these rows and vertical opening angle, where pixels are as large as anywhere: as
/// preparation counts them.
fn angle_rad(pixels: f64, fov_deg: f32, height_px: u32) -> f32 {
    pixels as f32 * 2.0 * libm::tanf(0.5 * fov_deg.to_radians()) / height_px.max(1) as f32
}

/// The sky between the two maps around the moment, the sun taken out, for it shines as one of its own.
fn sky_without_sun(bundle: &BundleReader, moment: &Moment) -> Result<HdrImage> {
    let [first, second] = moment.entries;
    let read = |entry: usize| -> Result<HdrImage> {
        let path = bundle.sky_map_path(entry);
        let map = HdrImage::read(&path).with_context(|| format!("the sky map of step {entry}"))?;
        match &bundle.lapse().steps[entry].sun {
            Some(sun) => without_sun(map, Vec3::from_array(sun.direction)),
            None => Ok(map),
        }
    };
    let map = read(first)?;
    if second == first || moment.entry_fraction <= 0.0 {
        return Ok(map);
    }
    Ok(map.mixed_lat_long(&read(second)?, moment.entry_fraction))
}

/// The map with the sky around it in place of the sun, where it shows one that stands where `sun` does.
fn without_sun(map: HdrImage, sun: Vec3) -> Result<HdrImage> {
    /// A sun in the map and one in the lapse are the same within this angle: the map's pixels are up to 0.7 degrees wide, and
    /// an interpolated map's sun lags behind by less than two degrees.
    const SAME_SUN_DEG: f32 = 3.0;
    let probe = Probe::new(map, Mapping::LatLong, 0.0)?;
    let found = find_sun(&probe, &SunParams::default());
    let same = |found: &FoundSun| Vec3::from_array(found.sun.direction).dot(sun) > libm::cosf(SAME_SUN_DEG.to_radians());
    Ok(match found.filter(same) {
        Some(found) => probe.with_pixels(&found.replaced).image().clone(),
        None => probe.image().clone(),
    })
}

/// The light of a time of day, in seconds after midnight.
pub fn moment(bundle: &BundleReader, seconds: f64, blend: Blend) -> Moment {
    Day::new(bundle.lapse()).at(seconds, blend)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_angles_as_preparation_counts_them() {
        // two metres of a wall a metre away are as high as the picture
        assert!((angle_rad(5.0, 90.0, 1000) - 0.01).abs() < 1e-8);
        assert_eq!(angle_rad(0.0, 50.0, 768), 0.0);
        // tan 25 degrees
        assert!((angle_rad(384.0, 50.0, 768) - 0.466_307_66).abs() < 1e-6);
    }
}
