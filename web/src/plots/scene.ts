// The mechanism in 3D: what was measured solid, what was predicted as a ghost.
import {
  AmbientLight, Color, DirectionalLight, GridHelper, PerspectiveCamera, Quaternion,
  Scene, WebGLRenderer,
} from 'three';
import {cividisRgb, errorFraction} from '../colors';
import {decode, errorMap, nearest, type ErrorMap} from '../data';
import type {PageData} from '../page_data';
import {theme} from '../state';
import {niceStep} from './axes';
import {Orbit} from './orbit';
import {loadRobot, type Robot} from './robot';
import {css} from './time_plot';

export interface Shown {
  page: PageData;
  model: number;
  run: number;
  exaggeration: number; // of the difference, 1 is true
}

const kMapColumns = 80;

export class MechanismScene {
  readonly grid: number; // m, size of a square
  readonly meshes: string[];
  readonly orbit: Orbit;
  private renderer: WebGLRenderer;
  private scene = new Scene();
  private camera = new PerspectiveCamera(40, 1, 0.01, 100);
  private solid: Robot;
  private ghost: Robot;
  private lines: GridHelper;
  private map: ErrorMap | null = null;
  private shown: Shown | null = null;
  private time = 0;
  private frame = 0;

  // Throws where there is no WebGL, or where the URDF cannot be read.
  constructor(private canvas: HTMLCanvasElement, page: PageData) {
    this.solid = loadRobot(page.mechanism, false);
    this.ghost = loadRobot(page.mechanism, true);
    this.meshes = this.solid.meshes;
    // Kept, so that the picture is printed.
    const context = canvas.getContext('webgl2', {antialias: true, alpha: true, preserveDrawingBuffer: true});
    if (!context) throw new Error('no WebGL');
    this.renderer = new WebGLRenderer({canvas, context});
    const size = this.solid.size;
    const [low, high] = this.solid.heights;
    this.grid = niceStep(size / 5);
    const squares = Math.ceil(1.6 * size / this.grid / 2) * 2;
    this.lines = new GridHelper(squares * this.grid, squares);
    this.lines.rotation.x = Math.PI / 2;
    this.lines.position.z = low;
    const sun = new DirectionalLight(0xffffff, 2);
    sun.position.set(1, -2, 3);
    this.scene.add(this.solid.root, this.ghost.root, this.lines, sun, new AmbientLight(0xffffff, 1.4));
    this.orbit = new Orbit(this.camera, () => this.draw());
    this.orbit.centre = [0, 0, (low + high) / 2];
    this.orbit.distance = Math.max(size, high - low) * 2.6;
    this.camera.near = size / 100;
    this.camera.far = size * 100;
    this.orbit.listen(canvas);
  }

  show(shown: Shown) {
    this.shown = shown;
    const {page, model, run} = shown;
    this.map = page.models[model]?.predictions[run] ? errorMap(page, model, run, kMapColumns) : null;
    this.at(this.time);
  }

  get minError(): number { return this.map?.min ?? 1; }
  get maxError(): number { return this.map?.max ?? 1; }

  at(time: number) {
    this.time = time;
    if (this.shown && this.map) {
      const i = nearest(decode(this.shown.page.runs[this.shown.run].t), time);
      this.pose(this.shown, i);
      this.colour(this.shown, this.map, time);
    }
    this.draw();
  }

  private pose({page, model, run, exaggeration}: Shown, i: number) {
    const prediction = page.models[model].predictions[run];
    page.mechanism.joints.forEach((joint, j) => {
      const width = joint.type === 'spherical' ? 4 : 1;
      const take = (from: typeof prediction.q) => Array.from({length: width}, (_, k) =>
          from[joint.q + k] ? decode(from[joint.q + k])[i] : NaN);
      const predicted = take(prediction.q);
      const measured = take(prediction.measuredQ);
      if (!predicted.every(Number.isFinite)) return;
      const known = measured.every(Number.isFinite) ? measured : predicted;
      this.solid.set(j, known);
      this.ghost.set(j, exaggerated(known, predicted, exaggeration));
    });
  }

  private colour({page, run}: Shown, map: ErrorMap, time: number) {
    const n = map.edges.length - 1;
    const [t0, t1] = [map.edges[0], map.edges[n]];
    const c = Math.min(n - 1, Math.max(0, Math.floor((time - t0) / (t1 - t0 || 1) * n)));
    page.mechanism.joints.forEach((joint, j) => {
      const errors = page.runs[run].channels
        .map((channel, r) => channel.joint === joint.name ? map.cells[r][c] : NaN)
        .filter(Number.isFinite);
      const color = errors.length
        ? cividisRgb(errorFraction(Math.max(...errors), map.max, map.min), theme.value === 'dark')
        : [140, 140, 140] as [number, number, number];
      this.solid.paint(j, color);
      this.ghost.paint(j, [230, 159, 0]);
    });
  }

  resize(width: number, height: number) {
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio || 1));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  // At most once a frame.
  draw() {
    if (this.frame) return;
    this.frame = requestAnimationFrame(() => {
      this.frame = 0;
      this.drawNow();
    });
  }

  drawNow() {
    const color = new Color(css('--floor'));
    const lines = this.lines.material;
    lines.vertexColors = false;
    lines.color = color;
    lines.needsUpdate = true;
    this.orbit.place();
    this.renderer.render(this.scene, this.camera);
    this.canvas.dataset.drawn = String(Number(this.canvas.dataset.drawn ?? 0) + 1);
  }

  dispose() {
    cancelAnimationFrame(this.frame);
    this.solid.dispose();
    this.ghost.dispose();
    this.renderer.dispose();
  }
}

// The prediction, its difference from the measurement times `k`.
function exaggerated(measured: number[], predicted: number[], k: number): number[] {
  if (k === 1) return predicted;
  if (measured.length === 1) return [measured[0] + k * (predicted[0] - measured[0])];
  const m = new Quaternion(...measured as [number, number, number, number]).normalize();
  const d = m.clone().invert().multiply(
      new Quaternion(...predicted as [number, number, number, number]).normalize());
  if (d.w < 0) d.set(-d.x, -d.y, -d.z, -d.w);
  const s = Math.hypot(d.x, d.y, d.z);
  const half = Math.atan2(s, d.w) * k;
  const f = s > 1e-12 ? Math.sin(half) / s : 0;
  m.multiply(new Quaternion(d.x * f, d.y * f, d.z * f, Math.cos(half)));
  return [m.x, m.y, m.z, m.w];
}
