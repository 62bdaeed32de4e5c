// Prints what Khronos' validator has to say of a binary glTF, as JSON.
import fs from 'node:fs';
import { createRequire } from 'node:module';

const [packages, file] = process.argv.slice(2);
const validator = createRequire(`${packages}/`)('gltf-validator');
const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)));
console.log(JSON.stringify(issues));
