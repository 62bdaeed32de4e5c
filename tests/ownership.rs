//! Who keeps Vulkan objects alive: commands what they record, sets and framebuffers what they bind.
//! The caller drops its own handles early; the validation layer reports whatever is freed too soon.

mod common;

use std::sync::{Arc, Mutex};

use common::{assert_silent, own_device};
use mesolux::vk::{
    Attachment, Bind, Binding, Buffer, BufferUse, Commands, ComputePipeline, ComputeShader, Device,
    Format, Framebuffer, Image, ImageUse, Interface, RenderPass, Sampled, Sampler, ShaderBinding,
    ShaderBindings, Stage, Timestamps, left,
};

/// A compute shader that doubles the first word of the storage buffer at binding 0.
fn doubling() -> Vec<u32> {
    let mut words = vec![0x0723_0203, 0x0001_0300, 0, 15, 0];
    let mut op = |code: u32, operands: &[u32]| {
        words.push((operands.len() as u32 + 1) << 16 | code);
        words.extend(operands);
    };
    let (shader, logical, glsl450, compute, local_size) = (1, 0, 1, 5, 17);
    let (block, array_stride, binding, descriptor_set, offset) = (2, 6, 33, 34, 35);
    let storage_buffer = 12;
    let [
        void,
        function,
        uint,
        array,
        buffer,
        buffer_pointer,
        variable,
    ] = [1, 2, 3, 4, 5, 6, 7];
    let [zero, uint_pointer, main, label, place, old, new] = [8, 9, 10, 11, 12, 13, 14];
    op(17, &[shader]); // OpCapability
    op(14, &[logical, glsl450]); // OpMemoryModel
    op(15, &[compute, main, u32::from_le_bytes(*b"main"), 0]); // OpEntryPoint
    op(16, &[main, local_size, 1, 1, 1]); // OpExecutionMode
    op(71, &[array, array_stride, 4]); // OpDecorate
    op(71, &[buffer, block]);
    op(72, &[buffer, 0, offset, 0]); // OpMemberDecorate
    op(71, &[variable, descriptor_set, 0]);
    op(71, &[variable, binding, 0]);
    op(19, &[void]); // OpTypeVoid
    op(33, &[function, void]); // OpTypeFunction
    op(21, &[uint, 32, 0]); // OpTypeInt
    op(29, &[array, uint]); // OpTypeRuntimeArray
    op(30, &[buffer, array]); // OpTypeStruct
    op(32, &[buffer_pointer, storage_buffer, buffer]); // OpTypePointer
    op(59, &[buffer_pointer, variable, storage_buffer]); // OpVariable
    op(43, &[uint, zero, 0]); // OpConstant
    op(32, &[uint_pointer, storage_buffer, uint]);
    op(54, &[void, main, 0, function]); // OpFunction
    op(248, &[label]); // OpLabel
    op(65, &[uint_pointer, place, variable, zero, zero]); // OpAccessChain
    op(61, &[uint, old, place]); // OpLoad
    op(128, &[uint, new, old, old]); // OpIAdd
    op(62, &[place, new]); // OpStore
    op(253, &[]); // OpReturn
    op(56, &[]); // OpFunctionEnd
    words
}

/// Runs a test on a device of its own, and fails if it frees anything too soon or not at all.
fn on_a_device(test: impl FnOnce(&Arc<Device>)) {
    // `left` counts the devices of the whole process: one test at a time.
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let _one = ONE_AT_A_TIME.lock().unwrap_or_else(|e| e.into_inner());
    let device = own_device();
    test(&device);
    assert_eq!(
        device.allocated_bytes(),
        0,
        "all buffers and images are freed"
    );
    drop(device);
    assert_eq!(left(), None);
    assert_silent();
}

fn buffer(device: &Arc<Device>, name: &str, bytes: u64, usage: BufferUse) -> Buffer {
    Buffer::new(device, name, bytes, usage).expect("a buffer")
}

const BYTES: u64 = 1 << 12;

/// What the shader of [`doubling`] binds.
struct Doubling<'a> {
    words: &'a Buffer,
    texture: Sampled<'a>,
}

impl ShaderBindings for Doubling<'_> {
    const BINDINGS: &'static [ShaderBinding] = &[
        ShaderBinding {
            name: "words",
            kind: Binding::Storage,
        },
        ShaderBinding {
            name: "texture",
            kind: Binding::Sampled,
        },
    ];

    fn binds(&self) -> Vec<Bind<'_>> {
        vec![Bind::Storage(self.words), Bind::Sampled(self.texture)]
    }
}

/// Commands that double a word `times` times; every handle but those to the commands and to the
/// result is dropped.
fn doubled(device: &Arc<Device>, times: u32) -> (Commands, Buffer) {
    let result = buffer(device, "result", 4, BufferUse::Readback);
    let words = buffer(device, "words", BYTES, BufferUse::Storage);
    let texture =
        Image::mipped(device, "texture", (4, 4), Format::R8G8B8A8_UNORM).expect("an image");
    let sampler = Sampler::new(device, "texture", true).expect("a sampler");
    let shader = ComputeShader {
        spirv: &doubling(),
        interface: Interface::of::<Doubling<'_>, ()>(),
    };
    let pipeline = ComputePipeline::new(device, "doubling", &shader).expect("a pipeline");
    let bindings = Doubling {
        words: &words,
        texture: Sampled {
            image: &texture,
            sampler: &sampler,
        },
    };
    let bound = pipeline.bind(&bindings).expect("a set");
    let stamps = Timestamps::new(device, "doubling", 1).expect("timestamps");
    let texels = buffer(device, "texels", 4 * (16 + 4 + 1), BufferUse::Upload);
    let commands = Commands::record(device, "doubling", |cmd| {
        cmd.reset_timestamps(&stamps);
        cmd.upload_texture(&texels, &texture, 4);
        cmd.fill(&words, 1);
        cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
        for _ in 0..times {
            cmd.dispatch(&bound, &(), [1, 1, 1]);
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        }
        cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
        cmd.copy(&words, 0, &result, 0, 4);
        cmd.barrier(&[Stage::Transfer], &[Stage::Host, Stage::Transfer]);
        cmd.timestamp(&stamps, 0);
        Ok(())
    })
    .expect("commands");
    (commands, result)
}

#[test]
fn commands_keep_what_they_record() {
    on_a_device(|device| {
        let (mut commands, result) = doubled(device, 10);
        let before = device.allocated_bytes();
        assert!(
            before >= BYTES,
            "{before} bytes: recorded buffers are alive"
        );
        // As often as one likes.
        for _ in 0..2 {
            commands.submit().expect("submitted");
            commands.wait().expect("done");
            assert_eq!(result.read::<u32>(0, 1), [1024]);
        }
        drop(commands);
        let after = device.allocated_bytes();
        assert!(after < BYTES, "{after} bytes: only the result is left");
    });
}

/// Dropping commands that are still executed waits for them before it frees anything.
#[test]
fn commands_under_way_are_waited_for() {
    on_a_device(|device| {
        let (mut commands, result) = doubled(device, 5000);
        commands.submit().expect("submitted");
        drop(commands);
        // 2^5000 modulo 2^32.
        assert_eq!(result.read::<u32>(0, 1), [0]);
    });
}

#[test]
fn framebuffers_keep_their_images() {
    on_a_device(|device| {
        let size = (8, 4);
        let texels = u64::from(size.0 * size.1);
        let result = buffer(device, "result", 4 * texels, BufferUse::Readback);
        let mut commands = {
            let colour = Attachment::copied(Format::R32_UINT);
            let [pass, _] = RenderPass::in_parts(device, "clear", colour).expect("a render pass");
            let image = |name, format, usage| {
                Image::new(device, name, size, format, usage).expect("an image")
            };
            let colour = image("colour", Format::R32_UINT, ImageUse::ColourTarget);
            let depth = image("depth", Format::D32_SFLOAT, ImageUse::DepthTarget);
            let target =
                Framebuffer::new(device, "clear", &pass, &colour, &depth).expect("a framebuffer");
            drop(depth);
            Commands::record(device, "clear", |cmd| {
                cmd.begin_render_pass(&pass, &target, [7; 4]);
                cmd.end_render_pass();
                cmd.copy_image_to_buffer(&colour, &result);
                cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
                Ok(())
            })
            .expect("commands")
        };
        commands.submit().expect("submitted");
        commands.wait().expect("done");
        assert_eq!(result.read::<u32>(0, texels as usize), [7; 32]);
    });
}

/// A buffer of addresses keeps alive the buffers at these addresses.
#[test]
fn a_table_keeps_the_buffers_it_refers_to() {
    on_a_device(|device| {
        let table = buffer(device, "table", 8, BufferUse::Storage);
        let chunk = buffer(device, "chunk", BYTES, BufferUse::Addressed);
        table.refer_to(&chunk);
        drop(chunk);
        assert!(device.allocated_bytes() >= BYTES);
        drop(table);
    });
}

/// Who makes a pipeline that the device has gets that one; other constants make another.
#[test]
fn a_pipeline_is_made_once() {
    on_a_device(|device| {
        let spirv = doubling();
        let shader = ComputeShader {
            spirv: &spirv,
            interface: Interface::of::<Doubling<'_>, ()>(),
        };
        let before = device.pipelines();
        let make = |constants: &[u32]| {
            let made = ComputePipeline::with_constants(device, "doubling", &shader, constants);
            drop(made.expect("a pipeline"));
            device.pipelines() - before
        };
        assert_eq!([make(&[]), make(&[]), make(&[1]), make(&[])], [1, 1, 2, 2]);
        let (_commands, _result) = doubled(device, 1);
        assert_eq!(device.pipelines() - before, 2);
    });
}
