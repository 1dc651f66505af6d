// Load packages with three.js in node and print what arrived, one JSON object for each file.
//     node three_load.mjs FOLDER_WITH_NODE_MODULES ROOM.usdz ...
import fs from 'node:fs';
import path from 'node:path';
import { pathToFileURL } from 'node:url';

// The loader decodes pictures through the page's elements; here they stay undecoded.
const element = () => ({ addEventListener() {}, removeEventListener() {}, set src(_) {}, style: {} });
globalThis.self = globalThis.window = globalThis;
globalThis.document = { createElementNS: element };

const [modules, ...files] = process.argv.slice(2);
const load = (name) => import(pathToFileURL(path.resolve(modules, 'node_modules', 'three', name)).href);
const THREE = await load('build/three.module.js');
const { USDLoader } = await load('examples/jsm/loaders/USDLoader.js');
const { GLTFLoader } = await load('examples/jsm/loaders/GLTFLoader.js');

function read(buffer, file) {
  if (!file.endsWith('.glb')) return new USDLoader().parse(buffer, path.dirname(file) + '/');
  const loader = new GLTFLoader();
  loader.register(() => ({ name: 'undecoded', loadTexture: async () => new THREE.Texture() }));
  return new Promise((done, failed) => loader.parse(buffer, '', (gltf) => done(gltf.scene), failed));
}

for (const file of files) {
  const bytes = fs.readFileSync(file);
  const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const scene = await read(buffer, file);
  scene.updateMatrixWorld(true);
  const found = { file, meshes: 0, triangles: 0, withoutUv: [], materials: new Set(), maps: {}, objects: {}, boxes: {}, cameras: [], lights: [] };
  scene.traverse((thing) => {
    if (thing.name) found.objects[thing.name] = true;
    if (thing.isCamera) found.cameras.push(thing.name);
    if (thing.isLight) found.lights.push(thing.type);
    if (thing.userData.id) {
      const own = new THREE.Box3().setFromObject(thing, true);
      found.boxes[thing.userData.id] = [own.min.toArray(), own.max.toArray()];
    }
    if (!thing.isMesh) return;
    const geometry = thing.geometry;
    found.meshes += 1;
    found.triangles += (geometry.index ? geometry.index.count : geometry.attributes.position.count) / 3;
    if (!geometry.attributes.uv) found.withoutUv.push(thing.name);
    for (const material of [thing.material].flat()) {
      found.materials.add(material.uuid);
      for (const map of ["map", "normalMap", "roughnessMap"]) if (material[map]) found.maps[map] = (found.maps[map] || 0) + 1;
    }
  });
  const box = new THREE.Box3().setFromObject(scene);
  console.log(JSON.stringify({
    ...found, materials: [...found.materials], objects: Object.keys(found.objects), low: box.min.toArray(), high: box.max.toArray(),
  }));
}
