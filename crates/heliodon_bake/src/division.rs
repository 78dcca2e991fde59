//! How a bake's work is divided into blocks, and whose they are: what shards and their merge must agree on.
//!
//! The plan and the division lie in the cache beside the blocks, as JSON, written by whoever comes first and the same for all: so a merge
//! knows without computing anything what is missing, and a launcher how far all shards are together.

use crate::cache::{Cache, CacheError};
use crate::key::TOOL;
use crate::plan::Plan;
use crate::shard::Shard;
use heliodon_bundle::StoredFile;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The plan in the cache.
pub const PLAN_FILE: &str = "plan.json";
/// Its division.
const DIVISION_FILE: &str = "blocks.json";

/// A stage that is divided.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StageBlocks {
    /// The name of its files.
    pub stage: String,
    /// How many blocks it has.
    pub blocks: usize,
}

/// All blocks of a bake that shards share, stage by stage.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Division {
    /// The stages.
    pub stages: Vec<StageBlocks>,
}

impl Division {
    /// Adds a stage.
    pub fn add(&mut self, stage: &str, blocks: usize) {
        self.stages.push(StageBlocks { stage: stage.to_owned(), blocks });
    }

    /// The number among all of a stage's first block; of an unknown stage 0.
    #[must_use]
    pub fn first_of(&self, stage: &str) -> usize {
        let before = self.stages.iter().position(|known| known.stage == stage).unwrap_or(0);
        self.stages[..before].iter().map(|stage| stage.blocks).sum()
    }

    /// Blocks of all stages.
    #[must_use]
    pub fn count(&self) -> usize {
        self.stages.iter().map(|stage| stage.blocks).sum()
    }

    /// The numbers among all of the blocks that a folder of the cache has not.
    #[must_use]
    pub fn missing(&self, has: impl Fn(&str, usize) -> bool) -> Vec<usize> {
        let of_stage = |stage: &StageBlocks| (0..stage.blocks).map(|block| !has(&stage.stage, block)).collect::<Vec<_>>();
        let missing = self.stages.iter().flat_map(of_stage).enumerate();
        missing.filter(|(_, missing)| *missing).map(|(block, _)| block).collect()
    }

    /// Keeps the division in the cache.
    ///
    /// # Errors
    /// A cache that cannot be written.
    pub fn keep(&self, cache: &Cache) -> Result<(), CacheError> {
        // names and numbers always have a JSON form
        cache.write_note(DIVISION_FILE, &serde_json::to_vec_pretty(self).unwrap_or_default())
    }

    /// The division that a shard has kept in a bake's folder.
    #[must_use]
    pub fn kept(folder: &Path) -> Option<Self> {
        serde_json::from_slice(&fs::read(folder.join(DIVISION_FILE)).ok()?).ok()
    }
}

/// The shards to which blocks belong, each once, ascending.
#[must_use]
pub fn shards_of(blocks: &[usize], count: u32) -> Vec<u32> {
    let mut shards: Vec<u32> = blocks.iter().map(|&block| Shard::of_block(block, count)).collect();
    shards.sort_unstable();
    shards.dedup();
    shards
}

/// What a plan was made from, for whoever finds its work and has another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanNote {
    /// The key.
    pub key: String,
    /// The program and its revision.
    pub tool: String,
    /// Into how many shards it was divided last.
    pub shards: u32,
    /// What `site.toml` says of the bake, of the sky, of the place, and of what geometry is prepared for.
    pub parameters: Value,
    /// The files that were read.
    pub inputs: Vec<StoredFile>,
}

impl PlanNote {
    /// The note of a plan with this key.
    #[must_use]
    pub fn new(plan: &Plan, key: &str, shards: u32) -> Self {
        let site = &plan.site;
        let value = |value: Result<Value, serde_json::Error>| value.unwrap_or_default();
        let parameters = serde_json::json!({
            "bake": value(serde_json::to_value(&site.bake)),
            "sky": value(serde_json::to_value(&site.sky)),
            "site": value(serde_json::to_value(&site.site)),
            "prepare": value(serde_json::to_value(&site.prepare)),
            // rooms and display decide nothing else
            "views": value(serde_json::to_value(site.prepare.as_ref().map(|_| (&site.rooms, &site.display)))),
        });
        Self { key: key.to_owned(), tool: TOOL.to_owned(), shards, parameters, inputs: plan.inputs.clone() }
    }

    /// Keeps it in the cache.
    ///
    /// # Errors
    /// A cache that cannot be written.
    pub fn keep(&self, cache: &Cache) -> Result<(), CacheError> {
        cache.write_note(PLAN_FILE, &serde_json::to_vec_pretty(self).unwrap_or_default())
    }

    /// The note in a bake's folder.
    #[must_use]
    pub fn read(folder: &Path) -> Option<Self> {
        serde_json::from_slice(&fs::read(folder.join(PLAN_FILE)).ok()?).ok()
    }

    /// The notes of all other plans whose work lies below `root`, in the order of their keys.
    #[must_use]
    pub fn others(&self, root: &Path) -> Vec<Self> {
        let folders = fs::read_dir(root).into_iter().flatten().flatten();
        let mut notes: Vec<Self> = folders.filter_map(|entry| Self::read(&entry.path())).collect();
        notes.retain(|note| note.key != self.key);
        notes.sort_by(|a, b| a.key.cmp(&b.key));
        notes
    }

    /// In what this plan differs from `other`, as far as notes tell.
    #[must_use]
    pub fn differences(&self, other: &Self) -> Vec<String> {
        let mut found = Vec::new();
        if self.tool != other.tool {
            found.push(format!("the program ({} there, {} here)", other.tool, self.tool));
        }
        let (here, there) = (leaves(&self.parameters), leaves(&other.parameters));
        let names: std::collections::BTreeSet<&String> = here.keys().chain(there.keys()).collect();
        let told = |value: Option<&&Value>| value.map_or_else(|| "nothing".to_owned(), |value| value.to_string());
        for name in names {
            let (here, there) = (here.get(name), there.get(name));
            if here != there {
                found.push(format!("{name} ({} there, {} here)", told(there), told(here)));
            }
        }
        let hashes = |note: &Self| -> BTreeMap<String, StoredFile> {
            note.inputs.iter().map(|file| (file.path.clone(), file.clone())).collect()
        };
        let (here, there) = (hashes(self), hashes(other));
        let files: std::collections::BTreeSet<&String> = here.keys().chain(there.keys()).collect();
        // of site.toml the parameters are told above
        let files = files.into_iter().filter(|name| *name != heliodon_bundle::site::SITE_FILE_NAME);
        found.extend(files.filter(|name| here.get(*name) != there.get(*name)).map(|name| format!("the file {name}")));
        if found.is_empty() {
            found.push("something in site.toml".to_owned());
        }
        found
    }
}

/// Every number and word of a JSON value, by its path.
fn leaves(value: &Value) -> BTreeMap<String, &Value> {
    let mut found = BTreeMap::new();
    let mut open = vec![(String::new(), value)];
    while let Some((path, value)) = open.pop() {
        match value {
            Value::Object(fields) => {
                let name = |field: &String| if path.is_empty() { field.clone() } else { format!("{path}.{field}") };
                open.extend(fields.iter().map(|(field, value)| (name(field), value)));
            }
            _ => drop(found.insert(path, value)),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_counted_through_all_stages() {
        let mut division = Division::default();
        division.add("sky", 3);
        division.add("masks", 2);
        assert_eq!((division.first_of("sky"), division.first_of("masks"), division.count()), (0, 3, 5));
        let has = |stage: &str, block: usize| (stage, block) != ("sky", 1) && (stage, block) != ("masks", 1);
        assert_eq!(division.missing(has), [1, 4]);
        assert_eq!(shards_of(&[1, 4], 3), [2]);
        assert_eq!(shards_of(&[1, 4], 2), [1, 2]);
    }

    #[test]
    fn differences_name_what_has_changed() {
        let note = |samples: u32, file: &str| PlanNote {
            key: "a".into(),
            tool: TOOL.into(),
            shards: 2,
            parameters: serde_json::json!({"bake": {"samples": samples, "seed": 1}}),
            inputs: vec![StoredFile { path: "a.ply".into(), bytes: 1, blake3: file.into() }],
        };
        assert_eq!(note(256, "x").differences(&note(64, "x")), ["bake.samples (64 there, 256 here)"]);
        assert_eq!(note(256, "x").differences(&note(256, "y")), ["the file a.ply"]);
        assert_eq!(note(1, "x").differences(&note(1, "x")), ["something in site.toml"]);
        let old = PlanNote { tool: "heliodon 0".into(), ..note(1, "x") };
        assert!(note(1, "x").differences(&old)[0].contains("heliodon 0 there"));
    }
}
