//! `heliodon display`: displays to begin with, what is bound, whether a display.toml holds together.

use crate::App;
use crate::failure::{WrongArguments, wrong_arguments};
use crate::{files, values};
use anyhow::{Result, bail};
use heliodon_bundle::display::{DISPLAY_FILE_NAME, Display, Preset};
use heliodon_bundle::site::Site;
use heliodon_view::input::{Action, Bindings, NOTATION};
use heliodon_view::tracking::Trackers;
use serde::Serialize;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

mod listen;

/// Writes a display.toml to start from, or checks one: its screens, its bindings, whether its ports are free, what its trackers say.
///
/// A viewer looks for display.toml beside the site, then for heliodon/display.toml in the user's configuration; `heliodon view --display` names
/// another one.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  heliodon display --preset flatworld -o mysite/display.toml\n  heliodon display mysite/display.toml\n  heliodon display mysite/display.toml --listen 60\n  heliodon display --actions"
)]
pub struct Args {
    /// A display.toml to check
    #[arg(value_name = "FILE", required_unless_present_any = ["preset", "actions"], conflicts_with_all = ["preset", "actions"])]
    file: Option<PathBuf>,
    /// What to start from: desktop, monitor, flatworld, cave or ring
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Where to write it [default: to the terminal]
    #[arg(short, long, value_name = "FILE", requires = "preset")]
    output: Option<PathBuf>,
    /// Tell each second where the trackers of FILE see heads and hands, for so many seconds
    #[arg(long, value_name = "SECONDS", value_parser = values::elapsed, conflicts_with_all = ["preset", "actions"])]
    listen: Option<f64>,
    /// List every action, what it is bound to, and what else it could be
    #[arg(long, conflicts_with = "preset")]
    actions: bool,
}

/// The preset of this name.
fn preset(name: &str) -> Result<Preset> {
    let names: Vec<&str> = Preset::ALL.iter().map(|preset| preset.name()).collect();
    Preset::named(name)
        .ok_or_else(|| WrongArguments(format!("there is no preset `{name}`: write one of {}", names.join(", "))).into())
}

/// The display of a file, or the preset of this name if there is no such file.
pub fn read(path: &Path) -> Result<Display> {
    match path.to_str().and_then(Preset::named) {
        Some(preset) if !path.exists() => Ok(Display::preset(preset)),
        _ => Ok(Display::read(path)?),
    }
}

/// The user's own folder of settings.
fn user_folder() -> Option<PathBuf> {
    let own = std::env::var_os("XDG_CONFIG_HOME").filter(|home| !home.is_empty()).map(PathBuf::from);
    let home = || std::env::home_dir().map(|home| home.join(".config"));
    own.or_else(home).map(|folder| folder.join("heliodon"))
}

/// The display of a viewer: the one that is named, or the one beside the site or bundle, or the user's own.
pub fn of_viewer(named: Option<&Path>, site: &Path) -> Result<Option<Arc<Display>>> {
    if let Some(path) = named {
        return Ok(Some(Arc::new(read(path)?)));
    }
    let beside = [site.join(DISPLAY_FILE_NAME), site.join("..").join(DISPLAY_FILE_NAME)];
    let user = user_folder().map(|folder| folder.join(DISPLAY_FILE_NAME));
    let found = beside.into_iter().chain(user).find(|path| path.is_file());
    Ok(found.map(Display::read).transpose()?.map(Arc::new))
}

/// An action, as it is listed.
#[derive(Serialize)]
struct Bound {
    action: &'static str,
    triggers: Vec<String>,
}

/// All actions.
#[derive(Serialize)]
struct Listed {
    actions: Vec<Bound>,
}

/// A display, as it is told.
#[derive(Serialize)]
struct Told {
    file: PathBuf,
    name: String,
    screens: Vec<String>,
    trackers: Vec<String>,
    faults: Vec<String>,
}

/// Runs it.
pub fn run(app: &App, args: &Args) -> Result<()> {
    if args.actions {
        let bindings = Bindings::default();
        let bound = |action: Action| Bound {
            action: action.name(),
            triggers: bindings.triggers(action).iter().map(ToString::to_string).collect(),
        };
        let listed = Listed { actions: Action::ALL.into_iter().map(bound).collect() };
        return app.output.result(&listed, |listed| {
            let lines: Vec<String> =
                listed.actions.iter().map(|bound| format!("{:<16} {}", bound.action, bound.triggers.join("  "))).collect();
            format!("{}\n\nAn action can be bound to {NOTATION}.", lines.join("\n"))
        });
    }
    if let Some(name) = &args.preset {
        let text = preset(name)?.file().to_toml_string();
        return match &args.output {
            Some(path) if path.exists() => bail!("{}: not replaced; choose another place or move it away", path.display()),
            Some(path) => {
                files::check_place(path)?;
                files::replace(path, |beside| Ok(std::fs::write(beside, &text)?))
            }
            None => Ok(std::io::stdout().write_all(text.as_bytes())?),
        };
    }
    let Some(file) = &args.file else { wrong_arguments!("name a display.toml, or --preset, or --actions") };
    let display = Display::read(file)?;
    if let Some(seconds) = args.listen {
        return listen::run(app, &display, seconds);
    }
    let told = check(&display)?;
    app.output.result(&told, |told| {
        let screens =
            if told.screens.is_empty() { "a desktop".to_owned() } else { format!("screens {}", told.screens.join(", ")) };
        let trackers =
            if told.trackers.is_empty() { String::new() } else { format!("; trackers {}", told.trackers.join(", ")) };
        format!("{}: {}, {screens}{trackers}", told.file.display(), told.name)
    })?;
    if told.faults.is_empty() {
        return Ok(());
    }
    bail!("{}", told.faults.join("\n"))
}

/// What a display has, and what is wrong with it beyond its text.
fn check(display: &Display) -> Result<Told> {
    let mut faults: Vec<String> = Trackers::new(display)?.faults().to_vec();
    let (_, unbound) = Bindings::new(&display.input);
    faults.extend(
        unbound
            .into_iter()
            .map(|fault| display.error_at(&["input", "bind", &fault.action], fault.message, fault.remedy).to_string()),
    );
    for (name, path) in display.control.iter().flat_map(|control| &control.sites) {
        let path = display.resolve(path);
        if !path.is_dir() {
            let message = format!("the site `{name}` is not at {}", path.display());
            faults.push(display.error_at(&["control", "sites", name], message, "give the folder of a bundle").to_string());
        }
    }
    Ok(Told {
        file: display.path().to_owned(),
        name: display.display.name.clone(),
        screens: display.screens.iter().map(|screen| screen.name.clone()).collect(),
        trackers: display.trackers.iter().map(|tracker| tracker.name.clone()).collect(),
        faults,
    })
}

/// The folder beside which a display is looked for: the site's or the bundle's.
pub fn folder_of(path: &Path) -> PathBuf {
    match Site::read(path) {
        Ok(site) => site.folder().to_owned(),
        Err(_) => path.to_owned(),
    }
}
