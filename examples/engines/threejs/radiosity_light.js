// Light of `radiosity` in three.js: at vertices (bake) or in light maps (light-map).
//
// Materials stay what the file says: textures, metal, emission. Baked irradiance is added to what
// they reflect diffusely, as a light map of three.js is, so that no lamp is needed in the scene.
import * as THREE from 'three';

// Materials of all meshes below `root` reflect the irradiance of their vertices: the attribute
// _IRRADIANCE, W/m2 per channel, of `radiosity bake SCENE.glb`. Colours of vertices that show it to
// other programs (COLOR_0) are switched off.
export function lightVertices(root) {
  const known = new Map();
  root.traverse((mesh) => {
    if (!mesh.isMesh || !mesh.geometry.attributes._irradiance) return;
    if (!known.has(mesh.material)) known.set(mesh.material, litByVertices(mesh.material));
    mesh.material = known.get(mesh.material);
  });
}

function litByVertices(source) {
  const material = source.clone();
  material.vertexColors = false;
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

// Materials of all meshes below `root`, the GLB of `radiosity light-map`, show their light map: an
// EXR file, irradiance in W/m2, which `texture` was loaded from by EXRLoader.
export function lightMap(root, texture) {
  // EXRLoader has the last row first, and TEXCOORD_1 has v = 0 at the first row.
  texture.channel = 1;
  texture.wrapT = THREE.RepeatWrapping;
  texture.repeat.set(1, -1);
  texture.offset.set(0, 1);
  texture.minFilter = texture.magFilter = THREE.LinearFilter;
  texture.generateMipmaps = false;
  root.traverse((mesh) => {
    if (!mesh.isMesh) return;
    // The file shows its light as colours; beside them it has what surfaces are.
    const { reflectance = [0.5, 0.5, 0.5], exitance = [0, 0, 0] } = mesh.material.userData;
    mesh.material = new THREE.MeshLambertMaterial({
      color: new THREE.Color(...reflectance),
      emissive: new THREE.Color(...exitance.map((x) => x / Math.PI)),
      lightMap: texture,
      side: mesh.material.side,
    });
  });
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
