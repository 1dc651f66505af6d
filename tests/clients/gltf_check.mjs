// Validate a glb with Khronos' validator and print its messages as one JSON object.
//     node gltf_check.mjs FOLDER_WITH_NODE_MODULES ROOM.glb
import fs from 'node:fs';
import path from 'node:path';
import { createRequire } from 'node:module';

const [modules, file] = process.argv.slice(2);
const validator = createRequire(path.resolve(modules, 'x.js'))('gltf-validator');
const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), { maxIssues: 1000 });
const told = {};
for (const { code } of report.issues.messages) told[code] = (told[code] || 0) + 1;
const { numErrors, numWarnings, numInfos, numHints } = report.issues;
console.log(JSON.stringify({ numErrors, numWarnings, numInfos, numHints, told }));
