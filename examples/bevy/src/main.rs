//! Draws in Bevy what `mesolux export` wrote:
//!
//! ```sh
//! mesolux export cornell-box --glb room.glb --light-map light.ktx2
//! cargo run --release --manifest-path examples/bevy/Cargo.toml -- room.glb light.ktx2
//! ```
//!
//! A third argument, a PNG, is where a picture is kept of it; the window closes then.

use std::f32::consts::PI;

use bevy::camera::Exposure;
use bevy::core_pipeline::tonemapping::Tonemapping;
use bevy::gltf::GltfAssetLabel;
use bevy::pbr::Lightmap;
use bevy::prelude::*;
use bevy::render::view::screenshot::{Screenshot, save_to_disk};

/// The light map, and the picture that is asked for.
#[derive(Resource)]
struct Wanted(Handle<Image>, Option<String>);

fn main() {
    let assets = AssetPlugin {
        file_path: std::env::current_dir()
            .expect("a folder")
            .display()
            .to_string(),
        ..default()
    };
    App::new()
        .add_plugins(DefaultPlugins.set(assets))
        // The light map holds all light.
        .insert_resource(GlobalAmbientLight::NONE)
        .add_systems(Startup, load)
        .add_systems(Update, (light_up, expose, put_out, shoot))
        .run();
}

fn load(mut commands: Commands, assets: Res<AssetServer>) {
    let mut paths = std::env::args().skip(1);
    let (Some(glb), Some(light)) = (paths.next(), paths.next()) else {
        panic!("usage: mesolux-bevy SCENE.glb LIGHT.ktx2 [PICTURE.png]");
    };
    let scene = assets.load(GltfAssetLabel::Scene(0).from_asset(glb));
    commands.spawn(WorldAssetRoot(scene));
    commands.insert_resource(Wanted(assets.load(light), paths.next()));
}

type New<'a> = (Entity, &'a MeshMaterial3d<StandardMaterial>);

/// The map holds irradiance; a surface sends 1/π of what it reflects of it.
fn light_up(
    meshes: Query<New, Added<MeshMaterial3d<StandardMaterial>>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
    wanted: Res<Wanted>,
    mut commands: Commands,
) {
    for (mesh, material) in &meshes {
        let image = wanted.0.clone();
        commands
            .entity(mesh)
            .insert(Lightmap { image, ..default() });
        if let Some(mut material) = materials.get_mut(material) {
            material.lightmap_exposure = 1.0 / PI;
        }
    }
}

/// Radiance as it is.
fn expose(cameras: Query<Entity, Added<Camera3d>>, mut commands: Commands) {
    for camera in &cameras {
        let ev100 = -1.2_f32.log2();
        (commands.entity(camera)).insert((Exposure { ev100 }, Tonemapping::None));
    }
}

/// The light of lamps is in the map already.
fn put_out(
    lamps: Query<Entity, Or<(Added<PointLight>, Added<DirectionalLight>)>>,
    mut commands: Commands,
) {
    for lamp in &lamps {
        commands.entity(lamp).despawn();
    }
}

fn shoot(
    wanted: Res<Wanted>,
    mut frame: Local<u32>,
    mut commands: Commands,
    mut exit: MessageWriter<AppExit>,
) {
    let Some(path) = &wanted.1 else { return };
    *frame += 1;
    match *frame {
        100 => drop(
            commands
                .spawn(Screenshot::primary_window())
                .observe(save_to_disk(path.clone())),
        ),
        200 => drop(exit.write(AppExit::Success)),
        _ => {}
    }
}
