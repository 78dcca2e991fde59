//! Small sites for the tests.

use glam::Vec3;
use heliodon_image::HdrImage;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A folder with a site that is removed at the end of the test.
pub struct TestSite {
    folder: tempfile::TempDir,
}

impl TestSite {
    /// The smallest site of the design: one mesh, one grey probe of radiance 1.
    pub fn smallest(obj: &str) -> Self {
        let site = Self { folder: tempfile::tempdir().unwrap() };
        site.write("mesh.obj", obj);
        HdrImage::filled(32, 16, Vec3::ONE).write_hdr(site.path("grey.hdr")).unwrap();
        site.write("site.toml", SMALLEST);
        site
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).unwrap();
    }

    /// Changes `site.toml`; what is replaced must be there.
    pub fn edit(&self, from: &str, to: &str) {
        let text = std::fs::read_to_string(self.path("site.toml")).unwrap();
        assert!(text.contains(from), "{from}");
        self.write("site.toml", text.replace(from, to));
    }
}

const SMALLEST: &str = r#"[site]
name = "Under a grey sky"
[[part]]
file = "mesh.obj"
role = "scan"
albedo = [0.5, 0.5, 0.5]
[sky]
probes = "grey.hdr"
mapping = "lat-long"
[bake]
bounces = 4
samples = 64
"#;

/// A square of `cells` x `cells` quadrangles with its front up, one metre wide.
pub fn plane(cells: usize) -> String {
    let mut text = String::new();
    for row in 0..=cells {
        for column in 0..=cells {
            let _ = writeln!(text, "v {} 0 {}", column as f32 / cells as f32, -(row as f32) / cells as f32);
        }
    }
    for row in 0..cells {
        for column in 0..cells {
            let a = row * (cells + 1) + column + 1;
            let (b, c, d) = (a + 1, a + cells + 2, a + cells + 1);
            let _ = writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}");
        }
    }
    text
}

/// A corrugated sheet, so that there are hits, shadows and bounces.
pub fn waves(cells: usize) -> String {
    let mut text = String::new();
    for line in plane(cells).lines() {
        match line.strip_prefix("v ") {
            Some(rest) => {
                let numbers: Vec<f32> = rest.split(' ').map(|number| number.parse().unwrap()).collect();
                // triangles of height 0.1, ten to the metre
                let height = 0.2 * ((numbers[0] * 10.0).fract() - 0.5).abs();
                let _ = writeln!(text, "v {} {height} {}", numbers[0], numbers[2]);
            }
            None => {
                let _ = writeln!(text, "{line}");
            }
        }
    }
    text
}

/// A probe with a small bright sun 45 degrees above the south on a dim sky.
pub fn sunny_probe() -> HdrImage {
    let (width, height) = (256, 128);
    HdrImage::from_fn(width, height, |x, y| {
        // the middle column looks north, so south is at both ends
        let in_sun = (x == 0 || x == width - 1) && (height / 4 - 1..=height / 4).contains(&y);
        if in_sun { Vec3::splat(5000.0) } else { Vec3::new(0.3, 0.4, 0.6) }
    })
}
