//! Draws in Bevy what `mesolux export` wrote:
//!
//! ```sh
//! mesolux export cornell-box --glb room.glb --light-map light.ktx2
//! cargo run --release --manifest-path examples/bevy/Cargo.toml -- room.glb light.ktx2
//! ```
//!
//! A third argument, a PNG, is where a picture is kept of it; the window closes then.
use bevy::gltf::GltfAssetLabel;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured, save_to_disk};
use bevy::{camera::Exposure, core_pipeline::tonemapping::Tonemapping, pbr::Lightmap, prelude::*};

#[derive(Resource)]
struct Paths(Vec<String>);

type Material = MeshMaterial3d<StandardMaterial>;

fn main() {
    let paths: Vec<String> = std::env::args().skip(1).collect();
    assert!(paths.len() > 1, "usage: mesolux-bevy SCENE.glb LIGHT.ktx2 [PICTURE.png]");
    let file_path = std::env::current_dir().expect("a folder").display().to_string();
    App::new()
        .add_plugins(DefaultPlugins.set(AssetPlugin { file_path, ..default() }))
        // The map holds all light, that of lamps as well.
        .insert_resource(GlobalAmbientLight::NONE)
        .add_observer(|new: On<Add, PointLight>, mut lamps: Query<&mut PointLight>| {
            lamps.get_mut(new.entity).expect("it is new").intensity = 0.0;
        })
        // Radiance as it is.
        .add_observer(|new: On<Add, Camera3d>, mut commands: Commands| {
            let ev100 = -1.2_f32.log2();
            commands.entity(new.entity).insert((Exposure { ev100 }, Tonemapping::None));
        })
        .insert_resource(Paths(paths))
        .add_systems(Startup, load)
        .add_systems(Update, (light_up, shoot))
        .run();
}

fn load(paths: Res<Paths>, assets: Res<AssetServer>, mut commands: Commands) {
    let scene = GltfAssetLabel::Scene(0).from_asset(paths.0[0].clone());
    commands.spawn(WorldAssetRoot(assets.load(scene)));
}

/// The map holds irradiance; a surface sends 1/π of what it reflects of it.
fn light_up(
    (paths, assets): (Res<Paths>, Res<AssetServer>),
    meshes: Query<(Entity, &Material), Added<Material>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    mut commands: Commands,
) {
    for (mesh, material) in &meshes {
        let image = assets.load(paths.0[1].clone());
        commands.entity(mesh).insert(Lightmap { image, ..default() });
        if let Some(mut material) = materials.get_mut(material) {
            material.lightmap_exposure = std::f32::consts::FRAC_1_PI;
        }
    }
}

fn shoot(paths: Res<Paths>, mut frame: Local<u32>, mut commands: Commands) {
    *frame += 1;
    if let (Some(path), 100) = (paths.0.get(2), *frame) {
        let mut shot = commands.spawn(Screenshot::primary_window());
        shot.observe(save_to_disk(path.clone()));
        shot.observe(|_: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
            exit.write(AppExit::Success);
        });
    }
}
