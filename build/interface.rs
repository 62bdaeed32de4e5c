//! What a pipeline's shaders read together.

use crate::glsl::{Binding, Declarations, Field};

/// A compute shader, or the vertex and the fragment shader of one pipeline.
#[derive(Default)]
pub struct Program {
    pub stages: Vec<Stage>,
    /// By number.
    pub bindings: Vec<Binding>,
    pub push_constants: Vec<Field>,
}

pub struct Stage {
    pub file: String,
    pub spirv: Vec<u32>,
}

impl Program {
    /// Adds a stage. Stages that share a binding name it alike; the push constants of one begin
    /// with those of the other.
    pub fn add(
        &mut self,
        file: &str,
        spirv: Vec<u32>,
        declared: Declarations,
    ) -> Result<(), String> {
        for binding in declared.bindings {
            let same =
                |known: &&Binding| known.number == binding.number || known.name == binding.name;
            match self.bindings.iter().find(same) {
                None => self.bindings.push(binding),
                Some(known) if *known == binding => {}
                Some(known) => {
                    return Err(format!(
                        "`{}` at binding {} and `{}` at binding {}",
                        known.declaration, known.number, binding.declaration, binding.number
                    ));
                }
            }
        }
        self.bindings.sort_by_key(|binding| binding.number);
        let fields = declared.push_constants;
        let common = self.push_constants.len().min(fields.len());
        if self.push_constants[..common] != fields[..common] {
            return Err("its push constants differ from those of the other stage".to_owned());
        }
        if fields.len() > common {
            self.push_constants = fields;
        }
        self.stages.push(Stage {
            file: file.to_owned(),
            spirv,
        });
        Ok(())
    }

    /// Checks that binding numbers have no gap, so that a list by number is the layout.
    pub fn check(&self) -> Result<(), String> {
        match (0..).zip(&self.bindings).find(|(i, b)| *i != b.number) {
            Some((missing, _)) => Err(format!("binding {missing} is missing")),
            None => Ok(()),
        }
    }
}
