//! Which part of a scene's light is drawn, and how.

use clap::{Args, ValueEnum};

use mesolux::render::{Direct, Light, Lighting, ReliefShading, Show};

#[derive(Args)]
pub struct ShowOptions {
    /// Which light is drawn
    #[arg(long, value_enum, default_value = "global")]
    light: LightName,
    /// How surfaces with relief are drawn [default: factored; clusters with --preset paper]
    #[arg(long, value_enum, conflicts_with = "reference")]
    shading: Option<ShadingName>,
    /// How light straight from emitters and point lights is drawn [default: sharp; slots with
    /// --preset paper]
    #[arg(long, value_enum, conflicts_with = "reference")]
    direct: Option<DirectName>,
    /// What is drawn
    #[arg(
        long,
        value_enum,
        default_value = "shaded",
        conflicts_with = "reference"
    )]
    view: ViewName,
    /// Leave out surfaces seen from behind, which are black otherwise: from outside, a room is open
    #[arg(long)]
    hide_backs: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum LightName {
    /// All of it
    Global,
    /// Emitters, and what comes straight from them and from point lights
    Direct,
    /// What has been reflected more than once
    Indirect,
    /// Direct, indirect and global side by side, as in the paper's Figure 3
    All,
}

#[derive(Clone, Copy, ValueEnum)]
enum ShadingName {
    /// Relief mapping, lit by the factors of the relief's response
    Factored,
    /// Relief mapping, lit as in the paper by a few parallel lights a triangle, each shadowed at
    /// each pixel; slower the more directions there are, and --direct does nothing
    Clusters,
    /// Flat and lit by the relief's response
    Normal,
    /// The same, its texture shifted by the height
    Parallax,
    /// As plain triangles
    None,
}

#[derive(Clone, Copy, ValueEnum)]
enum DirectName {
    /// Shadowed at each pixel by the scene and by the relief itself
    Sharp,
    /// As it was baked, on relief by the slots, as in the paper; quicker
    Slots,
}

#[derive(Clone, Copy, ValueEnum)]
enum ViewName {
    /// Light
    Shaded,
    /// Reflectance
    Albedo,
    /// Normals in the world, -1..1 as 0..1
    Normal,
    /// Of relief, from the lowest, black, to the highest, white; other surfaces grey
    Height,
    /// Irradiance over pi, as on a white surface
    Irradiance,
    /// Strongest slot of each triangle with relief: hue, its direction about the normal (red along
    /// u, yellow-green along v); bright, near the normal; coloured, most of the light, and grey,
    /// light from everywhere
    Slots,
    /// Fragments of prisms that a sample shades, hidden ones too, in the colours of the bar below
    Overdraw,
}

impl ShowOptions {
    /// The parts of the light, one picture each.
    pub fn parts(&self) -> &'static [Light] {
        match self.light {
            LightName::Global => &[Light::Global],
            LightName::Direct => &[Light::Direct],
            LightName::Indirect => &[Light::Indirect],
            LightName::All => &[Light::Direct, Light::Indirect, Light::Global],
        }
    }

    /// A part of the light, shown as the options say.
    pub fn apply<'a>(&self, lighting: Lighting<'a>, part: Light) -> Lighting<'a> {
        Lighting {
            part,
            shading: match self.shading {
                None => lighting.shading,
                Some(ShadingName::Factored) => ReliefShading::Factored,
                Some(ShadingName::Clusters) => ReliefShading::Clusters,
                Some(ShadingName::Normal) => ReliefShading::Normal,
                Some(ShadingName::Parallax) => ReliefShading::Parallax,
                Some(ShadingName::None) => ReliefShading::None,
            },
            direct: match self.direct {
                None => lighting.direct,
                Some(DirectName::Sharp) => Direct::Sharp,
                Some(DirectName::Slots) => Direct::Slots,
            },
            show: match self.view {
                ViewName::Shaded => Show::Shaded,
                ViewName::Albedo => Show::Albedo,
                ViewName::Normal => Show::Normal,
                ViewName::Height => Show::Height,
                ViewName::Irradiance => Show::Irradiance,
                ViewName::Slots => Show::Slots,
                ViewName::Overdraw => Show::Overdraw,
            },
            hide_backs: self.hide_backs,
            ..lighting
        }
    }
}
