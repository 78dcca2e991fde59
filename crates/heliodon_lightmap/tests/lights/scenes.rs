//! Lights for the tests.

use glam::Vec3;
use heliodon_lightmap::lights::{
    Amount, DirectionalSpec, DiscSpec, EmissiveTriangles, IesProfile, IesSpec, Light, LightFiles, LightSpec, MeshSpec,
    Photometry, PointSpec, RectangleSpec, SpotSpec,
};
use heliodon_math::random::Pcg32;
use std::sync::Arc;

/// A unit of light is a lumen: what is stated is what comes.
pub const LUMENS: Photometry = Photometry { lumens_per_unit: 1.0 };

pub const COLOUR: [f64; 3] = [1.0, 0.8, 0.5];

/// An uneven luminaire of all horizontal angles.
pub const STREET_LAMP: &str = "IESNA:LM-63-2002\n[TEST] none\nTILT=NONE\n1 1000 2 4 5 1 2 0.1 0.2 0.05\n0.9 1 50\n0 40 80 120\n\
     0 90 180 270 360\n100 200 300 0\n100 250 350 10\n100 150 400 0\n100 50 20 0\n100 200 300 0\n";

/// An icosahedron, a bent sheet, and a file.
pub struct Files;

impl LightFiles for Files {
    fn ies(&self, _file: &str) -> Result<Arc<IesProfile>, String> {
        IesProfile::parse(STREET_LAMP).map(Arc::new).map_err(|error| error.to_string())
    }

    fn mesh(&self, file: &str) -> Result<EmissiveTriangles, String> {
        match file {
            "lamp" => Ok(icosahedron(0)),
            "globe" => Ok(icosahedron(1)),
            "pane" => Ok(pane()),
            "sheet" => {
                let mut sheet = pane();
                sheet.positions[1].y = -0.4;
                Ok(sheet)
            }
            _ => Err("is not there: check its name".to_owned()),
        }
    }
}

fn pane() -> EmissiveTriangles {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.2, 0.0, 1.0), Vec3::new(0.1, 0.0, 0.8)];
    EmissiveTriangles { positions, triangles: vec![[0, 1, 2], [0, 2, 3]] }
}

/// An icosahedron of radius 0.3, each triangle divided into four so many times: 20 triangles, 80, ...
fn icosahedron(levels: u32) -> EmissiveTriangles {
    let g = 1.618_034_f32;
    let mut positions: Vec<Vec3> = Vec::new();
    for (a, b) in [(1.0, g), (1.0, -g), (-1.0, g), (-1.0, -g)] {
        positions.extend([Vec3::new(0.0, a, b), Vec3::new(a, b, 0.0), Vec3::new(b, 0.0, a)]);
    }
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    // neighbours are 2 apart
    let near = |a: Vec3, b: Vec3| ((a - b).length() - 2.0).abs() < 1e-3;
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                let [a, b, c] = [positions[i], positions[j], positions[k]];
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (b - a).cross(c - a).dot(a) > 0.0;
                    triangles.push(if outward { [i, j, k] } else { [i, k, j] }.map(|v| v as u32));
                }
            }
        }
    }
    for _ in 0..levels {
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let first = positions.len() as u32;
            for (from, to) in [(a, b), (b, c), (c, a)] {
                positions.push(positions[from as usize] + positions[to as usize]);
            }
            let [ab, bc, ca] = [first, first + 1, first + 2];
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
        positions.iter_mut().for_each(|p| *p = p.normalize_or_zero());
    }
    positions.iter_mut().for_each(|p| *p = p.normalize_or_zero() * 0.3);
    EmissiveTriangles { positions, triangles }
}

pub fn light(spec: &LightSpec) -> Light {
    Light::new(spec, LUMENS, &Files).unwrap()
}

pub fn point(place: [f64; 3], amount: Amount) -> LightSpec {
    LightSpec::Point(PointSpec { name: None, place, colour: COLOUR, amount })
}

pub fn spot(place: [f64; 3], look_at: [f64; 3], angle_deg: f64, edge: f64, amount: Amount) -> LightSpec {
    LightSpec::Spot(SpotSpec { name: None, place, look_at, angle_deg, edge, colour: COLOUR, amount })
}

pub fn measured(place: [f64; 3], look_at: [f64; 3], turn_deg: f64, amount: Option<Amount>) -> LightSpec {
    let file = "lamp.ies".to_owned();
    LightSpec::Ies(IesSpec { name: None, file, place, look_at: Some(look_at), turn_deg, colour: COLOUR, amount, factor: 1.0 })
}

pub fn sun(direction: [f64; 3], angular_radius_deg: f64, amount: Amount) -> LightSpec {
    LightSpec::Directional(DirectionalSpec { name: None, direction, angular_radius_deg, colour: COLOUR, amount })
}

pub fn rectangle(corners: [[f64; 3]; 3], two_sided: bool, amount: Amount) -> LightSpec {
    LightSpec::Rectangle(RectangleSpec { name: None, corners, two_sided, colour: COLOUR, amount })
}

pub fn disc(place: [f64; 3], look_at: [f64; 3], radius_m: f64, two_sided: bool, amount: Amount) -> LightSpec {
    LightSpec::Disc(DiscSpec { name: None, place, look_at, radius_m, two_sided, colour: COLOUR, amount })
}

pub fn mesh(file: &str, two_sided: bool, amount: Amount) -> LightSpec {
    LightSpec::Mesh(MeshSpec { name: None, file: file.to_owned(), two_sided, colour: COLOUR, amount })
}

/// Random numbers for places and directions.
pub struct Dice(pub Pcg32);

impl Dice {
    pub fn vector(&mut self, size: f32) -> Vec3 {
        Vec3::new(self.0.range_f32(-size, size), self.0.range_f32(-size, size), self.0.range_f32(-size, size))
    }

    pub fn unit(&mut self) -> Vec3 {
        loop {
            let v = self.vector(1.0);
            if (0.01..1.0).contains(&v.length()) {
                return v.normalize_or_zero();
            }
        }
    }

    pub fn pair(&mut self) -> [f32; 2] {
        [self.0.next_f32(), self.0.next_f32()]
    }

    pub fn place(&mut self, size: f32) -> [f64; 3] {
        self.vector(size).as_dvec3().to_array()
    }

    pub fn corners(&mut self, size: f32) -> [[f64; 3]; 3] {
        let (a, right) = (self.vector(size).as_dvec3(), self.vector(size).as_dvec3());
        let up = right.cross(self.vector(1.0).as_dvec3());
        [a, a + right, a + up].map(|p| p.to_array())
    }

    /// One light of each kind, within about two metres of the origin, each giving 100 in its unit.
    pub fn lights(&mut self) -> Vec<LightSpec> {
        let (flux, radiance) = (Amount::FluxLm(100.0), Amount::LuminanceCdM2(100.0));
        let edge = f64::from(self.0.next_f32());
        let (angle, radius) = (f64::from(self.0.range_f32(20.0, 300.0)), f64::from(self.0.range_f32(0.1, 1.5)));
        let wide = f64::from(self.0.range_f32(0.1, 80.0));
        let two_sided = self.0.next_f32() < 0.3;
        vec![
            point(self.place(2.0), flux),
            spot(self.place(2.0), self.place(2.0), angle, edge, Amount::IntensityCd(100.0)),
            measured(self.place(2.0), self.place(2.0), 10.0 * angle, None),
            sun(self.place(1.0), 0.0, Amount::IlluminanceLx(100.0)),
            sun(self.place(1.0), wide, Amount::IlluminanceLx(100.0)),
            rectangle(self.corners(2.0), two_sided, radiance),
            disc(self.place(2.0), self.place(2.0), radius, two_sided, radiance),
            mesh("pane", two_sided, radiance),
            mesh("lamp", false, radiance),
            mesh("globe", false, radiance),
        ]
    }
}
