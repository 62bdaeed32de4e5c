//! The numbers that Rust and GLSL share. `build.rs` reads this file too and hands each one to the shaders as a macro.

macro_rules! shared {
    ($($(#[$doc:meta])* $name:ident = $value:expr;)*) => {
        $($(#[$doc])* pub const $name: u32 = $value;)*
        /// Every shared constant by name.
        pub const SHARED: &[(&str, u32)] = &[$((stringify!($name), $value)),*];
    };
}

shared! {
    /// An item-buffer pixel that saw nothing, a slot that holds no source.
    NONE = 0xffff_ffff;
    /// Faces of a hemicube: top, +x, −x, +y, −y in the source's frame.
    FACES = 5;
    /// Most triangles of a meshlet.
    MESHLET_TRIANGLES = 64;
    /// `Source::kind`: a group of elements; one of the two hemispheres about a point light.
    KIND_SURFACE = 0;
    KIND_POINT = 1;
    /// Invocations of a workgroup of the passes with one invocation an element, source or pixel.
    GROUP = 64;
    /// Invocations of the one workgroup that selects sources.
    SELECT_GROUP = 256;
    /// How an element's form factor to a source is found: from afar as a point, by the source's outline, by its parts as
    /// points, or near it.
    RECEIVE_FAR = 0;
    RECEIVE_OUTLINE = 1;
    RECEIVE_PARTS = 2;
    RECEIVE_NEAR = 3;
    RECEIVE_KINDS = 4;
    /// Elements that an invocation sorts: as many share what it loads of each source.
    SORT_ELEMENTS = 4;
    /// Slots that a dispatch sorts receivers for, at most: the bits of a word.
    SORT_SLOTS = 32;
    /// Sources of a batch, at most, whose form factors were kept and need no drawing.
    REPLAYS = 496;
    /// Blocks of GROUP elements of a slot that a subgroup keeps the form factors of.
    KEEP_BLOCKS = 64;
    /// A kept source is shot again once it has this share (one over it) of the power of the strongest source.
    REPLAY_SHARE = 16;
    /// Binary digits behind the point of a form factor summed by integer atomics. A hemicube's whole sum is 1, so that
    /// 64 bits hold it eight times over, and the rounding of a pixel is 2⁻⁶² of it.
    FIXED_POINT_BITS = 61;
    /// Most directions of a meso element.
    MOST_DIRECTIONS = 64;
    /// Most parallel lights that the light on a face is drawn by.
    MOST_CLUSTERS = 64;
    /// Azimuths in which the horizon of a relief's facet is kept.
    AZIMUTHS = 128;
    /// A side of the grid of rays from each facet of a relief to the facets that it sees; RAY_STRATA² rays.
    RAY_STRATA = 8;
    /// Most factors of the light on a relief.
    MOST_RANK = 16;
    /// Points that emitters are taken for in a pixel where their light is drawn sharply, and by how many samples they are
    /// shared: those of 4 × 4 samples take turns.
    LIGHT_POINTS = 64;
    LIGHT_TURNS = 16;
    /// Sets of such points, one a pixel of each 4 × 4: 64 fixed points would show as bands in penumbrae.
    LIGHT_SETS = 16;
    /// One more than a leaf has triangles, at most, in the tree of what casts shadows.
    LEAF_TRIANGLES = 16;
    /// A sample of so many texels shows the mean of the relief.
    WIDEST_SAMPLE = 2;
    /// How relief is drawn: displaced; only lit, at its mean height; so too, and shifted by its height.
    SHADING_RELIEF = 0;
    SHADING_NORMAL = 1;
    SHADING_PARALLAX = 2;
    /// What is drawn of a relief.
    VIEW_SHADED = 0;
    VIEW_ALBEDO = 1;
    VIEW_NORMAL = 2;
    VIEW_HEIGHT = 3;
    VIEW_IRRADIANCE = 4;
    VIEW_SLOTS = 5;
    VIEW_OVERDRAW = 6;
}
