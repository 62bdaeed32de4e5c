//! What reading a scene has to say to the user.

/// One sentence each.
#[derive(Debug, Clone, Default)]
pub(super) struct Said {
    /// What was made up, or ignored without effect on the light.
    pub notes: Vec<String>,
    /// What was ignored and would change the light.
    pub warnings: Vec<String>,
}

impl Said {
    pub fn append(&mut self, other: Self) {
        self.notes.extend(other.notes);
        self.warnings.extend(other.warnings);
    }
}
