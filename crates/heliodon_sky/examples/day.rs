//! Builds the lapse of a clear day in Athens, or of the probes given, prints it, and writes a picture of what was found at every fifteenth entry:
//! `cargo run -p heliodon_sky --example day -- OUT.png [PROBE.hdr...]`.
#![expect(clippy::print_stdout, reason = "an example reports on stdout")]

use heliodon_image::{HdrImage, SheetLayout, contact_sheet};
use heliodon_sky::day::{LapseParams, ModelDay, ProbeFile, ProbeSeries, SkySource, build, table};
use heliodon_sky::mapping::Mapping;
use heliodon_sky::model::ModelParams;
use heliodon_sky::picture::found_picture;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let out = args.next().unwrap_or_else(|| "day.png".into());
    let files: Vec<ProbeFile> = args.map(|path| ProbeFile { path: path.into(), time: None }).collect();
    let source = if files.is_empty() {
        SkySource::Model(ModelDay {
            model: ModelParams::default(),
            latitude_deg: 37.9715,
            longitude_deg: 23.7267,
            utc_offset_hours: 2.0,
            date: "2023-05-01".parse()?,
        })
    } else {
        SkySource::Probes(ProbeSeries::new(files, Mapping::LatLong))
    };
    let mut maps: Vec<(String, HdrImage)> = Vec::new();
    let start = std::time::Instant::now();
    let built = build(&LapseParams::new(source), &mut |map| {
        if map.index % 15 == 0 {
            maps.push((map.name.to_string(), map.image.clone()));
        }
        Ok(())
    })?;
    println!("{}{} entries in {:.1?}", table(&built.lapse, 0.0), built.lapse.steps.len(), start.elapsed());
    built.notes.iter().for_each(|note| println!("{note}"));
    let pictures: Vec<_> = maps
        .iter()
        .filter_map(|(name, map)| Some(found_picture(map, built.lapse.steps.iter().find(|s| s.sky_map == *name)?, 360)))
        .collect();
    contact_sheet(&pictures, &SheetLayout::default()).write_png(out)?;
    Ok(())
}
