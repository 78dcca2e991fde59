//! The window of `heliodon photo mark`: photographs side by side, marks in them, and what they tell.
//!
//! | module | what it does |
//! | --- | --- |
//! | [`document`] | the project's file: edited, undone, saved; no window in it |
//! | [`solving`] | cameras, points and the model, on a thread of their own |
//! | [`wires`] | the model as lines, hidden ones told from others |
//! | [`pictures`] | photographs decoded, halved and cut into tiles; what a pane shows of them |
//! | [`app`] | the window: panes, lists, keys, dialogs; runs in any egui context |

pub mod app;
pub mod document;
pub mod pictures;
pub mod solving;
pub mod wires;

use app::MarkApp;
use document::{Document, DocumentError};
use eframe::egui::{Context, RawInput, Ui, ViewportBuilder};
use std::path::Path;
use std::sync::Arc;

/// Why there is no window.
#[derive(Debug, thiserror::Error)]
pub enum MarkError {
    /// The project cannot be opened.
    #[error(transparent)]
    Document(#[from] DocumentError),
    /// No window can be opened.
    #[error("no window can be opened: {0}; `heliodon photo solve` works without one")]
    Window(String),
}

struct Windowed(MarkApp);

impl eframe::App for Windowed {
    fn raw_input_hook(&mut self, ctx: &Context, input: &mut RawInput) {
        self.0.take_input(ctx, input);
    }

    fn ui(&mut self, ui: &mut Ui, _frame: &mut eframe::Frame) {
        self.0.show(ui);
    }
}

/// Opens a project, given its folder or its file, in a window, and returns when that is closed.
///
/// # Errors
/// Where the project cannot be opened, or there is no display to open a window on.
pub fn run(project: &Path) -> Result<(), MarkError> {
    let document = Document::open(project)?;
    let title = format!("{} - Heliodon", document.project().file.project.name);
    let viewport = ViewportBuilder::default().with_inner_size([1500.0, 940.0]).with_min_inner_size([900.0, 600.0]);
    let options = eframe::NativeOptions { viewport: viewport.with_title(&title), ..Default::default() };
    let made = eframe::run_native(
        "heliodon",
        options,
        Box::new(|creation| {
            let ctx = creation.egui_ctx.clone();
            app::dress(&ctx);
            Ok(Box::new(Windowed(MarkApp::new(document, Arc::new(move || ctx.request_repaint())))))
        }),
    );
    made.map_err(|error| MarkError::Window(error.to_string()))
}
