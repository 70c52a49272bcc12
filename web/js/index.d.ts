/** A colour of light: a number for all channels, or linear red, green and blue. */
export type Colour = number | [number, number, number];

/** A scene's file, and the files that it names: libraries, textures, buffers. */
export interface SceneFiles {
  /** Name of the file; its ending can say the format: .glb, .gltf, .obj, .stl. */
  name: string;
  content: Uint8Array | ArrayBuffer | string;
  /** By their paths from the scene's file. */
  files?: Record<string, Uint8Array | ArrayBuffer | string>;
}

export interface Options {
  /** Root mean square error of the reflected radiosity over the area, as a share: 0.05. */
  error?: number;
  /** Seconds after which the bake ends, with what there is. */
  time?: number;
  /** Whether each group of the scene has the error by itself. */
  eachGroup?: boolean;
  /** Radiance of materials by name, W/(m² sr). */
  emit?: Record<string, Colour>;
  /** Diffuse transmittance of materials by name. */
  transmit?: Record<string, Colour>;
  /** Radiance of a uniform sky, W/(m² sr); 1 where a scene has no light. */
  sky?: Colour;
  /** Direction towards the sun, and irradiance of a surface that faces it, W/m². */
  sun?: { direction: [number, number, number]; irradiance: Colour };
  /** Refuses files that would be repaired otherwise. */
  strict?: boolean;
  /**
   * What casts rays: a GPU by WebGPU ("gpu"), the CPU ("cpu"), or the GPU where there is one that is
   * not software ("auto", the default). The CPU gives the same bytes everywhere.
   */
  device?: "auto" | "cpu" | "gpu";
  /** Hears how far the bake is; answers `false` to stop it with what there is. */
  onProgress?: (progress: Progress) => boolean | void;
  /**
   * Hears of light as it gets better, complete each time; answers as `onProgress`. The first is of
   * stage "shape": reflectances, before there is light.
   */
  onLight?: (light: Arrays & Progress) => boolean | void;
  /** Stops the bake with what there is. */
  signal?: AbortSignal;
  /** In browsers: a worker that runs `worker.js`, for bundlers; `false` for the calling thread. */
  worker?: Worker | false;
  /** Address of `radiosity_bg.wasm`, for bundlers. */
  wasm?: string | URL;
}

export interface Progress {
  stage: string;
  /** Share of the stage that is done, in [0, 1]. */
  done: number | null;
  /** Estimated error so far, as a share. */
  error: number | null;
  seconds: number;
}

/** Light at vertices. */
export interface Arrays {
  /** Positions, three numbers a vertex, in the scene's unit and axes. */
  positions: Float64Array;
  /** Unit normals. */
  normals: Float64Array;
  /** Emitted and reflected light, W/m², red, green and blue; radiance is that over π. */
  radiosity: Float64Array;
  /** Light that arrives, W/m². */
  irradiance: Float64Array;
  /** Standard error of the radiosity, W/m², a length over the channels; empty before the end. */
  error: Float64Array;
  /** Corners of triangles, counter-clockwise from the front. */
  faces: Uint32Array;
}

export interface Report {
  /** Estimated error, as a share, and its parts. */
  error: number;
  errorParts: Record<"mesh" | "sampling" | "truncation" | "unshot" | "sources" | "tail", number>;
  errorOfGroups: Record<string, number>;
  /** Whether the error that was asked for is reached, and in words. */
  reached: boolean;
  outcome: string;
  /** Whether it was stopped. */
  stopped: boolean;
  vertices: number;
  triangles: number;
  gathers: number;
  /** The scene's upward axis. */
  up: [number, number, number];
  /** What cast rays, the name of a GPU, and why "auto" took the CPU. */
  device: "cpu" | "gpu";
  deviceName: string | null;
  deviceReason: string | null;
  /** Why the GPU failed, if it did: the CPU went on. */
  deviceFailure: string | null;
  /** What was odd about the file, and how it was repaired. */
  warnings: string[];
}

export interface Light extends Arrays {
  report: Report;
  /** The PLY file that the program writes, with the same numbers; colours are by a tone curve of its own. */
  ply(): Promise<Uint8Array>;
  /** For viewers: of a glTF scene the same file with light at its vertices. */
  glb(): Promise<Uint8Array>;
  /** Light after at most so many reflections, by elements. */
  bounces(count: number): Promise<Arrays>;
  /** Frees its memory, and ends its worker. */
  dispose(): void;
}

/**
 * Bakes the light of a scene.
 *
 * Rejects with an Error that says where in the input, what was found and what would be right.
 */
export function bake(scene: SceneFiles | File | File[] | FileList, options?: Options): Promise<Light>;

/** The GPU that can cast rays here; or what is missing for it. */
export function gpu(): Promise<
  | { name: string; isSoftware: boolean; missing?: undefined }
  | { missing: string; name?: undefined; isSoftware?: undefined }
>;

/** Whether WebAssembly has SIMD here, which the module needs. */
export function hasSimd(): boolean;

/** Version of the module. */
export function moduleVersion(): Promise<string>;
