//! Wrong lines of a scene file.

use super::refused;

#[test]
fn wrong_scene_files_are_named() {
    for (from, to, fragments) in [
        ("name = 'x'", "nam = 'x'", ["a.toml:1:", "nam"]),
        ("name = 'x'", "name = 'x", ["a.toml:1:", ""]),
        ("scale = 2", "size = 2", ["a.toml:4:", "size"]),
        (
            "scale = 2",
            "scale = 0",
            ["a.toml:2:", "scale must not be 0"],
        ),
        (
            "scale = 2",
            "scale = [1, 0, 1]",
            ["a.toml:2:", "scale must not be 0"],
        ),
        (
            "scale = 2",
            "scale = nan",
            ["a.toml:2:", "scale must be finite"],
        ),
        (
            "scale = 2",
            "scale = 'big'",
            ["a.toml:4:", "a number or [x, y, z]"],
        ),
        (
            "scale = 2",
            "scale = 1e308\ntranslate = [1e308, 0, 0]",
            ["a.toml:2:", "beyond every number"],
        ),
        (
            "scale = 2",
            "rotate = [0, inf, 0]",
            ["a.toml:2:", "rotate must be finite"],
        ),
        ("scale = 2", "translate = [0, 0]", ["a.toml:4:", ""]),
        (
            "scale = 2",
            "material = 'tin'",
            ["a.toml:2:", "material \"tin\""],
        ),
        (
            "file = 'a.obj'",
            "file = 'b.obj'",
            ["b.obj", "cannot be read"],
        ),
        ("file = 'a.obj'", "", ["a.toml:2:", "file"]),
        (
            "[[camera]]",
            "[material.tin]\nkd = [1,1,1]\n[[camera]]",
            ["a.toml:9:", "material \"tin\""],
        ),
        (
            "[[camera]]",
            "[material.lamp]\nkd = [1,2,1]\n[[camera]]",
            ["a.toml:9:", "reflectance Kd (1, 2, 1)"],
        ),
        (
            "[[camera]]",
            "[material.lamp]\nke = [1,nan,1]\n[[camera]]",
            ["a.toml:9:", "Ke"],
        ),
        (
            "[[camera]]",
            "[material.lamp]\nmap_kd = 'no.png'\n[[camera]]",
            ["\"lamp\"", "no.png"],
        ),
        (
            "[[camera]]",
            "[material.lamp]\ngloss = 1\n[[camera]]",
            ["a.toml:10:", "gloss"],
        ),
        (
            "[0, 1, 0]\nint",
            "[0, inf, 0]\nint",
            ["a.toml:5:", "point light \"p\": position"],
        ),
        (
            "intensity = [1, 1, 1]",
            "intensity = [1, -1, 1]",
            ["a.toml:5:", "point light \"p\": intensity"],
        ),
        (
            "intensity = [1, 1, 1]",
            "intensity = [1, 1e39, 1]",
            ["a.toml:5:", "point light \"p\": intensity"],
        ),
        ("intensity = [1, 1, 1]", "", ["a.toml:5:", "intensity"]),
        (
            "fov = 40",
            "fov = 180",
            ["a.toml:9:", "camera \"c\": fov 180"],
        ),
        (
            "fov = 40",
            "fov = nan",
            ["a.toml:9:", "camera \"c\": fov NaN"],
        ),
        ("fov = 40", "", ["a.toml:9:", "fov"]),
        (
            "look_at = [0, 0, 0]",
            "look_at = [0, 0, 5]",
            ["a.toml:9:", "same point"],
        ),
        (
            "look_at = [0, 0, 0]",
            "look_at = [0, 0, nan]",
            ["a.toml:9:", "finite"],
        ),
        (
            "up = [0, 1, 0]",
            "up = [0, 0, -2]",
            ["a.toml:9:", "parallel"],
        ),
        ("up = [0, 1, 0]", "up = [0, 0, 0]", ["a.toml:9:", "zero"]),
        (
            "[[camera]]",
            "[[camera]]\nname='c'\nposition=[1,0,0]\nlook_at=[0,0,0]\nfov=9\n[[camera]]",
            ["a.toml:14:", "earlier"],
        ),
    ] {
        refused("a.toml", "a.toml", from, to, &fragments);
    }
}
