// The picture: light at vertices, drawn by three.js.

import {
  BufferAttribute, BufferGeometry, Color, LineBasicMaterial, LineSegments, Mesh,
  MeshBasicMaterial, PerspectiveCamera, Scene, Vector3, WebGLRenderer, WireframeGeometry,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";

import { colours } from "./colours.js";

/** Share of the distance by which a key moves. */
const STEP = 0.08;

export class Viewer {
  #canvas;
  #renderer;
  #scene = new Scene();
  #camera = new PerspectiveCamera(45, 1, 0.01, 100);
  #controls;
  #mesh;
  #lines;
  #origin = [0, 0, 0];
  #drawn = false;

  constructor(canvas) {
    this.#canvas = canvas;
    this.#renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.#renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.#scene.background = new Color(0x000000);
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.addEventListener("change", () => this.draw());
    canvas.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.#resize()).observe(canvas);
    this.#resize();
  }

  /** Shows light of a new scene, seen by `camera`: eye, target, up and vertical field of view. */
  frame(light, { eye, target, up, fov }) {
    this.#origin = [...target];
    const from = (point) => new Vector3(...point.map((x, k) => x - this.#origin[k]));
    this.#camera.up.set(...up);
    this.#camera.position.copy(from(eye));
    this.#camera.fov = fov;
    const reach = extent(light.positions, this.#origin);
    this.#camera.near = reach * 1e-3;
    this.#camera.far = reach * 1e2;
    this.#camera.updateProjectionMatrix();
    this.#controls.target.set(0, 0, 0);
    this.#controls.update();
  }

  /** Shows the shape of light. */
  show(light, quantity, stops, elements) {
    this.#mesh?.geometry.dispose();
    this.#scene.clear();
    const geometry = new BufferGeometry();
    const count = light.positions.length / 3;
    const positions = new Float32Array(3 * count);
    for (let k = 0; k < positions.length; k++) positions[k] = light.positions[k] - this.#origin[k % 3];
    geometry.setAttribute("position", new BufferAttribute(positions, 3));
    geometry.setIndex(new BufferAttribute(light.faces, 1));
    const shown = colours(light, quantity, stops);
    geometry.setAttribute("color", new BufferAttribute(shown.values, 3));
    this.#mesh = new Mesh(geometry, new MeshBasicMaterial({ vertexColors: true }));
    this.#scene.add(this.#mesh);
    if (elements) {
      this.#lines?.geometry.dispose();
      const material = new LineBasicMaterial({ color: 0x3fa7ff, transparent: true, opacity: 0.45 });
      this.#lines = new LineSegments(new WireframeGeometry(geometry), material);
      this.#scene.add(this.#lines);
    }
    this.draw();
    return shown.legend;
  }

  draw() {
    if (this.#drawn) return;
    this.#drawn = true;
    requestAnimationFrame(() => {
      this.#drawn = false;
      this.#renderer.render(this.#scene, this.#camera);
    });
  }

  /** The picture as PNG. */
  png() {
    this.#renderer.render(this.#scene, this.#camera);
    return new Promise((resolve) => this.#canvas.toBlob(resolve, "image/png"));
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.#canvas;
    if (!width || !height) return;
    this.#renderer.setSize(width, height, false);
    this.#camera.aspect = width / height;
    this.#camera.updateProjectionMatrix();
    this.draw();
  }

  #key(event) {
    const way = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    const closer = { "+": 1, "=": 1, "-": -1, "−": -1 }[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey || (!way && !closer)) return;
    event.preventDefault();
    const { position, up } = this.#camera;
    const target = this.#controls.target;
    const offset = position.clone().sub(target);
    if (closer) {
      offset.multiplyScalar(1 - closer * STEP);
    } else {
      const right = offset.clone().cross(up).normalize();
      const [x, y] = way;
      if (event.shiftKey) {
        const over = up.clone().multiplyScalar(y).addScaledVector(right, x);
        over.multiplyScalar(STEP * offset.length());
        target.add(over);
      } else {
        offset.applyAxisAngle(up.clone().normalize(), x * STEP);
        const tilted = offset.clone().applyAxisAngle(right, y * STEP);
        // Not over the pole.
        if (tilted.angleTo(up) > 0.05 && tilted.angleTo(up) < Math.PI - 0.05) offset.copy(tilted);
      }
    }
    position.copy(target).add(offset);
    this.#controls.update();
    this.draw();
  }
}

/** Distance of the farthest vertex from a point. */
function extent(positions, [x, y, z]) {
  let most = 1e-30;
  for (let k = 0; k < positions.length; k += 3) {
    most = Math.max(
      most,
      Math.hypot(positions[k] - x, positions[k + 1] - y, positions[k + 2] - z),
    );
  }
  return most;
}
