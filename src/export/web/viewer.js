// A viewer of a scene with its light: WebGL 2, no library.
// Loads scene.glb, and scene.json, which names the pages of direct and indirect light.
'use strict';

const VERTEX = `#version 300 es
in vec3 position;
in vec2 uv;
in vec2 place;
uniform mat4 matrix;
uniform vec3 offset;
out vec2 of_maps;
out vec2 of_light;
void main() {
  of_maps = uv;
  of_light = place;
  gl_Position = matrix * vec4(position + offset, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec2 of_maps;
in vec2 of_light;
uniform sampler2D direct_light;
uniform sampler2D indirect_light;
uniform vec2 scales; // of direct and indirect light
uniform vec2 parts; // which of these are shown
uniform sampler2D colour;
uniform vec3 reflectance;
uniform vec3 emitted;
uniform float exposure;
out vec4 shown;

// RGBM is not linear: its four texels are decoded before they are mixed.
vec3 light(sampler2D map, vec2 at) {
  ivec2 size = textureSize(map, 0);
  vec2 p = at * vec2(size) - 0.5;
  ivec2 corner = ivec2(floor(p));
  vec2 part = p - floor(p);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 4; ++k) {
    ivec2 step = ivec2(k & 1, k >> 1);
    vec4 texel = texelFetch(map, clamp(corner + step, ivec2(0), size - 1), 0);
    vec2 along = mix(1.0 - part, part, vec2(step));
    sum += along.x * along.y * texel.rgb * texel.a;
  }
  return sum;
}

// Khronos PBR Neutral.
vec3 neutral(vec3 c) {
  const float start = 0.8 - 0.04;
  float least = min(c.r, min(c.g, c.b));
  c -= least < 0.08 ? least - 6.25 * least * least : 0.04;
  float peak = max(c.r, max(c.g, c.b));
  if (peak < start) return c;
  float rest = 1.0 - start;
  float lower = 1.0 - rest * rest / (peak + rest - start);
  float grey = 1.0 - 1.0 / (0.15 * (peak - lower) + 1.0);
  return mix(c * lower / peak, vec3(lower), grey);
}

vec3 coded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}

void main() {
  vec3 irradiance = parts.x * scales.x * light(direct_light, of_light)
      + parts.y * scales.y * light(indirect_light, of_light);
  vec3 radiance = reflectance * texture(colour, of_maps).rgb * irradiance / 3.14159265;
  radiance += parts.x * emitted;
  shown = vec4(coded(neutral(radiance * exposure)), 1.0);
}`;

const canvas = document.getElementById('view');
const gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });

// 4 x 4 matrices, column after column.
function multiply(a, b) {
  const out = new Float32Array(16);
  for (let c = 0; c < 4; ++c)
    for (let r = 0; r < 4; ++r)
      for (let k = 0; k < 4; ++k) out[4 * c + r] += a[4 * k + r] * b[4 * c + k];
  return out;
}
const subtract = (a, b) => a.map((x, k) => x - b[k]);
const add = (a, b, by = 1) => a.map((x, k) => x + by * b[k]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => a.map((x) => x / Math.hypot(...a));

function perspective(fov, aspect, near, far) {
  const f = 1 / Math.tan(fov / 2);
  const m = new Float32Array(16);
  m[0] = f / aspect; m[5] = f; m[10] = (far + near) / (near - far); m[11] = -1;
  m[14] = 2 * far * near / (near - far);
  return m;
}
function lookAt(eye, target, up) {
  const z = unit(subtract(eye, target)), x = unit(cross(up, z)), y = cross(z, x);
  return new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0,
    -dot(x, eye), -dot(y, eye), -dot(z, eye), 1]);
}
// A vector turned by a quaternion.
function turned([x, y, z, w], v) {
  const t = cross([x, y, z], v).map((k) => 2 * k);
  return add(add(v, t, w), cross([x, y, z], t));
}

function program() {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  ['position', 'uv', 'place'].forEach((name, index) => gl.bindAttribLocation(made, index, name));
  gl.linkProgram(made);
  return made;
}

async function texture(blob, { repeats = false, srgb = false } = {}) {
  // Alpha is a number here, and must stay as it is.
  const image = await createImageBitmap(blob, { premultiplyAlpha: 'none', colorSpaceConversion: 'none' });
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
  gl.texImage2D(gl.TEXTURE_2D, 0, srgb ? gl.SRGB8_ALPHA8 : gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
  const wrap = repeats ? gl.REPEAT : gl.CLAMP_TO_EDGE;
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wrap);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wrap);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, repeats ? gl.LINEAR_MIPMAP_LINEAR : gl.NEAREST);
  if (repeats) gl.generateMipmap(gl.TEXTURE_2D);
  return made;
}
function white() {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4).fill(255));
  return made;
}

// The JSON and the bytes of a binary glTF.
function parts(buffer) {
  const view = new DataView(buffer);
  if (view.getUint32(0, true) !== 0x46546c67) throw new Error('scene.glb is no binary glTF');
  const length = view.getUint32(12, true);
  const json = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
  return { json, bytes: new Uint8Array(buffer, 20 + length + 8) };
}

async function load() {
  const about = await (await fetch('scene.json')).json();
  const { json, bytes } = parts(await (await fetch('scene.glb')).arrayBuffer());
  const slice = (index) => {
    const { byteOffset, byteLength } = json.bufferViews[index];
    return bytes.slice(byteOffset, byteOffset + byteLength);
  };
  const page = async (name) => texture(await (await fetch(name)).blob());
  const light = await Promise.all(about.pages.map(async (names) => ({
    direct: await page(names.direct), indirect: await page(names.indirect),
  })));
  const blank = white();
  const images = new Map();
  const colours = async (info) => {
    if (!info) return blank;
    const source = json.textures[info.index].source;
    if (!images.has(source)) {
      const blob = new Blob([slice(json.images[source].bufferView)], { type: json.images[source].mimeType });
      images.set(source, await texture(blob, { repeats: true, srgb: true }));
    }
    return images.get(source);
  };
  const materials = await Promise.all(json.materials.map(async (material) => {
    const surface = material.pbrMetallicRoughness;
    const extensions = material.extensions || {};
    const strength = (extensions.KHR_materials_emissive_strength || {}).emissiveStrength || 1;
    const map = extensions.MOZ_lightmap;
    const name = map ? json.images[json.textures[map.index].source].name : 'light 1';
    return {
      reflectance: surface.baseColorFactor.slice(0, 3),
      colour: await colours(surface.baseColorTexture),
      emitted: (material.emissiveFactor || [0, 0, 0]).map((c) => c * strength),
      light: light[Number(name.split(' ')[1]) - 1],
    };
  }));
  const low = [Infinity, Infinity, Infinity], high = low.map((x) => -x);
  const meshes = [];
  const cameras = [];
  for (const node of json.nodes) {
    const offset = node.translation || [0, 0, 0];
    if (node.camera !== undefined) {
      const turn = node.rotation || [0, 0, 0, 1];
      cameras.push({
        eye: offset, way: turned(turn, [0, 0, -1]), up: turned(turn, [0, 1, 0]),
        fov: json.cameras[node.camera].perspective.yfov,
      });
    }
    if (node.mesh === undefined) continue;
    for (const primitive of json.meshes[node.mesh].primitives) {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      ['POSITION', 'TEXCOORD_0', 'TEXCOORD_1'].forEach((name, index) => {
        const accessor = json.accessors[primitive.attributes[name]];
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
        gl.bufferData(gl.ARRAY_BUFFER, slice(accessor.bufferView), gl.STATIC_DRAW);
        gl.enableVertexAttribArray(index);
        gl.vertexAttribPointer(index, accessor.type === 'VEC3' ? 3 : 2, gl.FLOAT, false, 0, 0);
        if (accessor.min) {
          accessor.min.forEach((x, k) => { low[k] = Math.min(low[k], x + offset[k]); });
          accessor.max.forEach((x, k) => { high[k] = Math.max(high[k], x + offset[k]); });
        }
      });
      const indices = json.accessors[primitive.indices];
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, slice(indices.bufferView), gl.STATIC_DRAW);
      meshes.push({ array, count: indices.count, offset, material: materials[primitive.material] });
    }
  }
  return { about, meshes, cameras, low, high };
}

function start({ about, meshes, cameras, low, high }) {
  const shader = program();
  const at = (name) => gl.getUniformLocation(shader, name);
  const places = Object.fromEntries(['matrix', 'offset', 'direct_light', 'indirect_light', 'scales', 'parts',
    'colour', 'reflectance', 'emitted', 'exposure'].map((name) => [name, at(name)]));
  const size = Math.hypot(...subtract(high, low));
  const middle = add(low, high).map((x) => x / 2);
  const first = cameras[0] || { eye: add(middle, [0, 0, 1], size), way: [0, 0, -1], up: [0, 1, 0], fov: 0.7 };
  const state = { part: 'global', exposure: about.exposure };
  function home() {
    // Orbits about the point in front of the camera that is nearest to the middle of the scene.
    const distance = Math.max(dot(subtract(middle, first.eye), first.way), 0.1 * size);
    state.target = add(first.eye, first.way, distance);
    state.distance = distance;
    state.up = first.up;
    state.back = first.way.map((x) => -x);
  }
  home();

  function draw() {
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth * ratio, canvas.clientHeight * ratio].map(Math.round);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    // Surfaces have one side.
    gl.enable(gl.CULL_FACE);
    gl.useProgram(shader);
    const eye = add(state.target, state.back, state.distance);
    const view = lookAt(eye, state.target, state.up);
    const near = 1e-3 * Math.max(state.distance, 0.1 * size);
    const lens = perspective(first.fov, width / height, near, state.distance + 4 * size);
    gl.uniformMatrix4fv(places.matrix, false, multiply(lens, view));
    const shown = { global: [1, 1], direct: [1, 0], indirect: [0, 1] }[state.part];
    gl.uniform2fv(places.parts, shown);
    gl.uniform2f(places.scales, about.scales.direct, about.scales.indirect);
    gl.uniform1f(places.exposure, 2 ** state.exposure);
    ['direct_light', 'indirect_light', 'colour'].forEach((name, unitNumber) => gl.uniform1i(places[name], unitNumber));
    for (const { array, count, offset, material } of meshes) {
      [material.light.direct, material.light.indirect, material.colour].forEach((map, unitNumber) => {
        gl.activeTexture(gl.TEXTURE0 + unitNumber);
        gl.bindTexture(gl.TEXTURE_2D, map);
      });
      gl.uniform3fv(places.offset, offset);
      gl.uniform3fv(places.reflectance, material.reflectance);
      gl.uniform3fv(places.emitted, material.emitted);
      gl.bindVertexArray(array);
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    }
    document.title = `${about.name}: ${state.part}, ${state.exposure.toFixed(2)}`;
  }
  let asked = false;
  function redraw() {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => { asked = false; draw(); });
  }

  function turn(v, axis, angle) {
    const [s, c] = [Math.sin(angle), Math.cos(angle)];
    return add(add(v.map((x) => x * c), cross(axis, v), s), axis, dot(axis, v) * (1 - c));
  }
  let drag = null;
  canvas.addEventListener('pointerdown', (event) => {
    drag = { x: event.clientX, y: event.clientY, pans: event.button !== 0 || event.shiftKey };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!drag) return;
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    Object.assign(drag, { x: event.clientX, y: event.clientY });
    const right = unit(cross(state.up, state.back));
    if (drag.pans) {
      const step = 2 * Math.tan(first.fov / 2) * state.distance / canvas.clientHeight;
      state.target = add(add(state.target, right, -dx * step), cross(state.back, right), dy * step);
    } else {
      const angle = Math.PI / canvas.clientHeight;
      const back = turn(turn(state.back, state.up, -dx * angle), right, -dy * angle);
      // Not over the top.
      if (Math.abs(dot(back, state.up)) < 0.995) state.back = unit(back);
      else state.back = unit(turn(state.back, state.up, -dx * angle));
    }
    redraw();
  });
  canvas.addEventListener('pointerup', () => { drag = null; });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('dblclick', () => { home(); redraw(); });
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    state.distance = Math.min(Math.max(state.distance * Math.exp(0.001 * event.deltaY), 1e-3 * size), 10 * size);
    redraw();
  }, { passive: false });
  window.addEventListener('resize', redraw);

  const buttons = [...document.querySelectorAll('[data-part]')];
  function show(part) {
    state.part = part;
    buttons.forEach((button) => button.setAttribute('aria-pressed', button.dataset.part === part));
    redraw();
  }
  buttons.forEach((button) => button.addEventListener('click', () => show(button.dataset.part)));
  const slider = document.getElementById('exposure');
  function expose(stops) {
    state.exposure = stops;
    document.getElementById('stops').textContent = (stops - about.exposure).toFixed(1);
    redraw();
  }
  slider.value = 0;
  slider.addEventListener('input', () => expose(about.exposure + Number(slider.value)));
  document.getElementById('name').textContent = about.name;
  expose(about.exposure);
  show('global');
  draw();
}

function fail(error) {
  document.getElementById('name').textContent = gl ? String(error.message || error) : 'WebGL 2 is not there';
}
if (gl) load().then(start).catch(fail);
else fail(new Error());
