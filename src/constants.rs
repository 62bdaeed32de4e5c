//! The numbers that Rust and GLSL share. The build script also reads this file and passes each one
//! to the shaders as a macro.

macro_rules! shared {
    ($($(#[$doc:meta])* $name:ident = $value:expr;)*) => {
        $($(#[$doc])* pub const $name: u32 = $value;)*
        /// Every shared constant by name.
        pub const SHARED: &[(&str, u32)] = &[$((stringify!($name), $value)),*];
    };
}

shared! {
    /// An item-buffer pixel that sees nothing, a slot without a source.
    NONE = 0xffff_ffff;
    /// Faces of a hemicube: top, +x, −x, +y, −y in the source's frame.
    FACES = 5;
    /// Most triangles of a meshlet.
    MESHLET_TRIANGLES = 64;
    /// `Source::kind`: a group of elements; one of the two hemispheres about a point light; a sun;
    /// a part of the sky; a point light whose intensity depends on the direction.
    KIND_SURFACE = 0;
    KIND_POINT = 1;
    KIND_SUN = 2;
    KIND_SKY = 3;
    KIND_BEAM = 4;
    /// Invocations of a workgroup of the passes with one invocation an element, source or pixel.
    GROUP = 64;
    /// Invocations of the one workgroup that selects sources.
    SELECT_GROUP = 256;
    /// How an element's form factor to a source is found: from afar as a point, by the source's
    /// outline, by its parts as points, by its outline where the horizon cuts that, or near it.
    RECEIVE_FAR = 0;
    RECEIVE_OUTLINE = 1;
    RECEIVE_PARTS = 2;
    RECEIVE_CUT = 3;
    RECEIVE_NEAR = 4;
    RECEIVE_KINDS = 5;
    /// The lists after those: elements of which the item buffer leaves open whether they are seen,
    /// and elements that a silhouette may cut the source for.
    RECEIVE_DOUBTFUL = 5;
    RECEIVE_CROSSED = 6;
    RECEIVE_LISTS = 7;
    /// Places on a strong emitter from which rays find the share of it that such an element sees;
    /// on other sources, and where settings ask for it, fewer. A power of two.
    SOURCE_EYES = 128;
    /// The first of those are its ends: where they are seen as its eye is, no silhouette cuts it.
    SOURCE_ENDS = 4;
    /// Invocations that share the places from which one such element is looked at.
    CROSSED_LANES = 8;
    /// Of the places on a light without a surface: those that an element asks first. Where these
    /// agree, no edge cuts the light.
    FIRST_EYES = 8;
    /// Elements that an invocation surveys: they share what it loads of a direction.
    SURVEY_ELEMENTS = 4;
    /// Invocations that share the rays of an element that an edge cuts a light for.
    LIGHT_LANES = 8;
    /// Bits of a listed element, and above them of the share of a source that it sees.
    LISTED_BITS = 25;
    SHARE_BITS = 7;
    /// Elements that an invocation sorts: they share the data that it loads of each source.
    SORT_ELEMENTS = 4;
    /// Most slots that a dispatch sorts receivers for: the bits of a word.
    SORT_SLOTS = 32;
    /// Most sources of a batch whose form factors were kept and need no drawing.
    REPLAYS = 496;
    /// Blocks of GROUP elements of a slot that a subgroup keeps the form factors of.
    KEEP_BLOCKS = 64;
    /// A kept source is shot again once it has this share (one over it) of the power of the
    /// strongest source.
    REPLAY_SHARE = 16;
    /// Binary digits behind the point of a form factor summed by integer atomics. A hemicube's
    /// whole sum is 1, so that 64 bits leave room for eight times that, and the rounding of a pixel
    /// is 2⁻⁶² of it.
    FIXED_POINT_BITS = 61;
    /// Most directions of a meso element.
    MOST_DIRECTIONS = 64;
    /// Most parallel lights of a face.
    MOST_CLUSTERS = 64;
    /// Azimuths in which the horizon of a relief's facet is kept.
    AZIMUTHS = 128;
    /// A side of the grid of rays from each facet of a relief to the facets that it sees;
    /// RAY_STRATA² rays.
    RAY_STRATA = 8;
    /// Functions of the direction of incoming light by which a relief responds to it.
    RELIEF_RANK = 16;
    /// A side of the square of cells between which they are bilinear.
    FINE_DIRECTIONS = 32;
    /// Most factors of the light on a relief.
    MOST_RANK = 16;
    /// Light points of the emitters for one pixel where their light is drawn sharply, and the
    /// number of samples that share them: 4 × 4 samples take turns.
    LIGHT_POINTS = 64;
    LIGHT_TURNS = 16;
    /// Sets of such points, one a pixel of each 4 × 4: 64 fixed points would show as bands in
    /// penumbrae.
    LIGHT_SETS = 16;
    /// One more than the most triangles of a leaf in the tree of shadow casters.
    LEAF_TRIANGLES = 16;
    /// Mark of a node of that tree in which all triangles have a relief.
    RELIEF_NODE = 0x8000_0000;
    /// Sectors of directions in which the horizon of a relief is known, and the bound that says
    /// nothing.
    HORIZON_SECTORS = 16;
    HORIZON_UNKNOWN = 255;
    /// Texels of the widest sample that shows the relief itself; wider ones show its mean.
    WIDEST_SAMPLE = 2;
    /// How relief is drawn: displaced; only lit, at its mean height; the same, with the texture
    /// shifted by its height.
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
    /// How light points light a draw: not at all, without anything between, as its parts say.
    LIT_NOT = 0;
    LIT_OPEN = 1;
    LIT_IN_PARTS = 2;
    /// Part of a triangle that lights are seen from: they may be hidden in part; nothing stands
    /// between; something stands before all of each.
    PART_UNSURE = 0;
    PART_OPEN = 1;
    PART_HIDDEN = 2;
}
