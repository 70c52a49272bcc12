// Light of `radiosity` in three.js: at vertices (bake) or in light maps (light-map).
//
// Materials stay what the file says: textures, metal, emission. Baked irradiance is added to what
// they reflect diffusely, as a light map of three.js is, so that no lamp is needed in the scene.
import * as THREE from 'three';

// Materials of all meshes below `root` reflect the irradiance of their vertices: the attribute
// _IRRADIANCE, W/m2 per channel, of `radiosity bake SCENE.glb`. Colours of vertices that show it to
// other programs (COLOR_0) are switched off. False where no mesh has it.
export function lightVertices(root) {
  const known = new Map();
  root.traverse((mesh) => {
    // The mesh of `bake --refine` has its radiosity, too, and shows that.
    const { _irradiance, _radiosity } = mesh.isMesh ? mesh.geometry.attributes : {};
    if (!_irradiance || _radiosity) return;
    const isLight = mesh.geometry.userData.radiosity?.COLOR_0 === 'light';
    const key = `${mesh.material.uuid} ${isLight}`;
    if (!known.has(key)) known.set(key, litByVertices(mesh.material, isLight));
    mesh.material = known.get(key);
  });
  return known.size > 0;
}

function litByVertices(source, colourIsLight) {
  const material = source.clone();
  if (colourIsLight) material.vertexColors = false;
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader
      .replace('void main() {', 'attribute vec3 _irradiance;\nvarying vec3 vIrradiance;\nvoid main() {\nvIrradiance = _irradiance;');
    shader.fragmentShader = shader.fragmentShader
      .replace('void main() {', 'varying vec3 vIrradiance;\nvoid main() {')
      .replace('#include <lights_fragment_maps>', '#include <lights_fragment_maps>\nirradiance += vIrradiance;');
  };
  material.customProgramCacheKey = () => 'radiosity vertices';
  return material;
}

// Materials of all meshes below `root`, the file of `radiosity light-map SCENE.glb`, get the light
// maps that it names, irradiance in W/m2. `load` gives the texture of a file, as EXRLoader's loadAsync
// does. False where no mesh names any.
export async function lightByMaps(root, load) {
  const meshes = [];
  root.traverse((mesh) => mesh.isMesh && mesh.geometry.userData.radiosity?.lightMap && meshes.push(mesh));
  const textures = new Map();
  const materials = new Map();
  for (const mesh of meshes) {
    const { lightMap, texCoord } = mesh.geometry.userData.radiosity;
    if (!textures.has(lightMap)) textures.set(lightMap, prepared(await load(lightMap), texCoord));
    const key = `${mesh.material.uuid} ${lightMap} ${texCoord}`;
    if (!materials.has(key)) {
      const material = mesh.material.clone();
      material.lightMap = textures.get(lightMap);
      materials.set(key, material);
    }
    mesh.material = materials.get(key);
  }
  return meshes.length > 0;
}

function prepared(texture, texCoord) {
  // EXRLoader has the last row first, and glTF has v = 0 at the first row.
  texture.channel = texCoord;
  texture.wrapT = THREE.RepeatWrapping;
  texture.repeat.set(1, -1);
  texture.offset.set(0, 1);
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.generateMipmaps = false;
  return texture;
}

// The tone curve of the program's pictures (Reinhard, Stark, Shirley, Ferwerda 2002, equation 4, on
// luminance): `renderer.toneMapping = THREE.CustomToneMapping` after it, with the exposure that
// `bake` prints as `renderer.toneMappingExposure`.
export function useToneCurveOfPictures() {
  THREE.ShaderChunk.tonemapping_pars_fragment = THREE.ShaderChunk.tonemapping_pars_fragment.replace(
    'vec3 CustomToneMapping( vec3 color ) { return color; }',
    `vec3 CustomToneMapping( vec3 color ) {
      color *= toneMappingExposure;
      float l = dot( color, vec3( 0.2126, 0.7152, 0.0722 ) );
      float white = 2.24;
      return clamp( color * ( 1.0 + l / ( white * white ) ) / ( 1.0 + l ), 0.0, 1.0 );
    }`,
  );
}
