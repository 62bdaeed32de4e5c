//! Finds the declarations of bindings and push constants in preprocessed GLSL.

/// What a binding is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Storage,
    Sampled,
    Texels,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Binding {
    pub number: u32,
    /// Of a buffer, that of its one member.
    pub name: String,
    /// As declared, for documentation.
    pub declaration: String,
    pub kind: Kind,
}

/// A member of the push constants.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Field {
    pub name: String,
    pub glsl_type: String,
}

#[derive(Debug, Default)]
pub struct Declarations {
    pub bindings: Vec<Binding>,
    pub push_constants: Vec<Field>,
}

/// Tokens still to be read: words, and single characters of punctuation.
struct Tokens<'a> {
    rest: Vec<&'a str>,
}

pub fn declarations(text: &str) -> Result<Declarations, String> {
    let mut tokens = Tokens::new(text);
    let mut found = Declarations::default();
    while let Some(token) = tokens.next() {
        if token != "layout" {
            continue;
        }
        let layout = tokens.layout()?;
        let value = |key: &str| layout.iter().find(|q| q.first() == Some(&key));
        if value("push_constant").is_some() {
            if !found.push_constants.is_empty() {
                return Err("two blocks of push constants".to_owned());
            }
            tokens.skip_to("{")?;
            found.push_constants = tokens.members()?;
        } else if let Some(qualifier) = value("binding") {
            let number = qualifier.last().unwrap_or(&"");
            let number = number
                .parse()
                .map_err(|_| format!("binding {number} is not a number"))?;
            found.bindings.push(tokens.binding(number)?);
        }
    }
    Ok(found)
}

impl<'a> Tokens<'a> {
    fn new(text: &'a str) -> Self {
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let mut tokens = Vec::new();
        let mut rest = text.trim_start();
        while let Some(first) = rest.chars().next() {
            let end = match is_word(first) {
                true => rest.find(|c| !is_word(c)).unwrap_or(rest.len()),
                false => first.len_utf8(),
            };
            tokens.push(&rest[..end]);
            rest = rest[end..].trim_start();
        }
        tokens.reverse();
        Self { rest: tokens }
    }

    fn next(&mut self) -> Option<&'a str> {
        self.rest.pop()
    }

    fn expect(&mut self, wanted: &str) -> Result<(), String> {
        match self.next() {
            Some(token) if token == wanted => Ok(()),
            token => Err(format!("{wanted} expected, {token:?} found")),
        }
    }

    fn word(&mut self) -> Result<&'a str, String> {
        self.next().ok_or_else(|| "the text ends early".to_owned())
    }

    /// Tokens up to `end`, which is read too.
    fn skip_to(&mut self, end: &str) -> Result<Vec<&'a str>, String> {
        let mut skipped = Vec::new();
        loop {
            match self.word()? {
                token if token == end => return Ok(skipped),
                token => skipped.push(token),
            }
        }
    }

    /// The qualifiers in the parentheses after `layout`, each as its tokens.
    fn layout(&mut self) -> Result<Vec<Vec<&'a str>>, String> {
        self.expect("(")?;
        let inside = self.skip_to(")")?;
        Ok(inside.split(|t| *t == ",").map(<[_]>::to_vec).collect())
    }

    /// What follows the layout of a binding.
    fn binding(&mut self, number: u32) -> Result<Binding, String> {
        let mut words = Vec::new();
        loop {
            match self.word()? {
                "{" => break,
                ";" => return image(number, &words),
                word => words.push(word),
            }
        }
        let [.., "buffer", block] = words[..] else {
            return Err(format!("binding {number} is neither a buffer nor an image"));
        };
        let member = self.skip_to(";")?;
        self.expect("}")
            .map_err(|_| format!("buffer {block} has more than one member"))?;
        let [glsl_type, name, array @ ..] = &member[..] else {
            return Err(format!("buffer {block} has no member"));
        };
        Ok(Binding {
            number,
            name: (*name).to_owned(),
            declaration: format!("buffer {block} {{ {glsl_type} {name}{}; }}", array.concat()),
            kind: Kind::Storage,
        })
    }

    /// Members of a block of scalars and vectors, up to its end.
    fn members(&mut self) -> Result<Vec<Field>, String> {
        let mut members = Vec::new();
        loop {
            let glsl_type = match self.word()? {
                "}" => return Ok(members),
                word => word.to_owned(),
            };
            let name = self.word()?.to_owned();
            self.expect(";")
                .map_err(|_| format!("push constant {name} is an array"))?;
            members.push(Field { name, glsl_type });
        }
    }
}

/// A binding that is not a buffer.
fn image(number: u32, words: &[&str]) -> Result<Binding, String> {
    let ["uniform", glsl_type, name] = words else {
        return Err(format!("binding {number} is neither a buffer nor an image"));
    };
    let kind = match *glsl_type {
        "sampler2D" | "usampler2D" => Kind::Sampled,
        "usamplerBuffer" => Kind::Texels,
        other => return Err(format!("binding {number} has the unknown type {other}")),
    };
    Ok(Binding {
        number,
        name: (*name).to_owned(),
        declaration: format!("uniform {glsl_type} {name}"),
        kind,
    })
}
