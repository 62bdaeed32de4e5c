//! Files that the user opens and saves.

use std::path::{Path, PathBuf};

use egui_file_dialog::FileDialog;

use super::Viewer;
use crate::view::recent;

/// A dialog for files, and what for.
#[derive(Default)]
pub(super) struct Files {
    dialog: Option<(FileDialog, Purpose)>,
    /// Scenes and bakes that were opened before, the latest first.
    pub recent: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    Open,
    SaveBake,
}

/// Files that can be opened.
const SCENES: [&str; 5] = ["toml", "obj", "gltf", "glb", "safetensors"];
const SCENES_NAME: &str = "scenes and bakes";
const BAKES_NAME: &str = "bakes";

impl Viewer {
    /// Looks for a scene or a bake to open.
    pub(super) fn browse(&mut self) {
        let dialog = self
            .dialog("Open a scene or a bake")
            .add_file_filter_extensions(SCENES_NAME, SCENES.to_vec())
            .default_file_filter(SCENES_NAME);
        self.show_dialog(dialog, Purpose::Open, FileDialog::pick_file);
    }

    /// Asks where the bake is to be saved.
    pub(super) fn ask_where_to_save(&mut self) {
        if let Some(reason) = self.why_no_bake() {
            self.say(reason.into());
            return;
        }
        let dialog = self
            .dialog("Save the bake")
            .default_file_name("bake.safetensors")
            .add_save_extension(BAKES_NAME, "safetensors")
            .default_save_extension(BAKES_NAME);
        self.show_dialog(dialog, Purpose::SaveBake, FileDialog::save_file);
    }

    /// Why there is no bake to be saved.
    pub(super) fn why_no_bake(&self) -> Option<&'static str> {
        if !self.baker.has_solved() {
            return Some("nothing has been baked here");
        }
        let changed = self.lamps != self.first_lamps || self.relief_scale != 1.0;
        changed.then_some(
            "a bake is of its scene as it is on disk: undo the changed lights or heights first",
        )
    }

    fn dialog(&self, title: &str) -> FileDialog {
        let folder = Path::new(&self.name).parent();
        let folder = folder.filter(|folder| folder.is_dir());
        let here = || std::env::current_dir().unwrap_or_default();
        let size = self.egui.content_rect().size() - egui::vec2(64.0, 96.0);
        FileDialog::new()
            .title(title)
            .initial_directory(folder.map_or_else(here, Path::to_owned))
            .default_size(
                size.min(egui::vec2(720.0, 480.0))
                    .max(egui::vec2(240.0, 160.0)),
            )
            .anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO)
            .as_modal(true)
    }

    fn show_dialog(
        &mut self,
        mut dialog: FileDialog,
        purpose: Purpose,
        begin: impl FnOnce(&mut FileDialog),
    ) {
        begin(&mut dialog);
        self.files.dialog = Some((dialog, purpose));
        self.dirty = true;
    }

    /// Whether a dialog is open.
    pub(super) fn has_dialog(&self) -> bool {
        self.files.dialog.is_some()
    }

    /// Draws the dialog that is open; returns what was picked.
    pub(super) fn draw_dialog(&mut self, context: &egui::Context) {
        let Some((dialog, purpose)) = &mut self.files.dialog else {
            return;
        };
        let purpose = *purpose;
        dialog.update(context);
        let picked = dialog.take_picked();
        let open = *dialog.state() == egui_file_dialog::DialogState::Open;
        if picked.is_some() || !open {
            self.files.dialog = None;
        }
        match (picked, purpose) {
            (Some(path), Purpose::Open) => self.open(path.display().to_string()),
            (Some(path), Purpose::SaveBake) => self.save_bake(path),
            (None, _) => {}
        }
    }

    /// Saves the bake as it is.
    pub(in crate::view) fn save_bake(&mut self, path: PathBuf) {
        match self.why_no_bake() {
            Some(reason) => {
                self.saving.retain(|under_way| *under_way != path);
                self.say(reason.into());
            }
            None => self.baker.save(path),
        }
    }

    /// Keeps the scene that is shown among the recent ones.
    pub(super) fn remember(&mut self) {
        let Some(folder) = &self.settings.relief.cache else {
            return;
        };
        let name = Path::new(&self.name);
        if !name.is_file() {
            self.files.recent = recent::read(folder);
            return;
        }
        let absolute = std::path::absolute(name).unwrap_or_else(|_| name.to_owned());
        self.files.recent = recent::add(folder, &absolute.display().to_string());
    }
}
