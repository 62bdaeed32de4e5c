//! The cases of `bench stress` in their small size. Those that are not right yet are ignored, each
//! with what is wrong.

mod common;

use common::{assert_silent, device};
use mesolux::bench::stress::{CASES, Context, Size};

fn passes(name: &str) {
    let case = CASES
        .iter()
        .find(|c| c.name == name)
        .expect("a case of that name");
    let context = Context {
        device: device(),
        size: Size::Small,
    };
    let verdict = case.verdict(&context);
    println!("{name}: {}", verdict.found());
    assert!(verdict.passes(), "{}: {}", case.asked, verdict.found());
    assert_silent();
}

macro_rules! cases {
    ($($(#[$attribute:meta])* $name:ident)*) => {
        $(
            #[test]
            $(#[$attribute])*
            fn $name() {
                passes(stringify!($name));
            }
        )*

        #[test]
        fn every_case_has_a_test() {
            assert_eq!([$(stringify!($name)),*], CASES.map(|c| c.name));
        }
    };
}

cases! {
    scale offset no_emission emission black white many_shots
    nearly_white
    occluders
    slivers
    specks degenerate duplicates shuffled non_manifold
    touching interpenetrating
    thin_gap
    open_sheet
    one_pixel
    map_shapes extreme_heights
}
