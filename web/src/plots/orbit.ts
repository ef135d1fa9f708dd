// A camera that goes around a point; z is up.
import type {PerspectiveCamera} from 'three';

export class Orbit {
  azimuth = -Math.PI / 2 + 0.35;
  elevation = 0.25;
  distance = 3;
  centre: [number, number, number] = [0, 0, 0];

  constructor(private camera: PerspectiveCamera, private changed: () => void) {
    camera.up.set(0, 0, 1);
  }

  place() {
    const c = Math.cos(this.elevation) * this.distance;
    this.camera.position.set(
        this.centre[0] + c * Math.cos(this.azimuth),
        this.centre[1] + c * Math.sin(this.azimuth),
        this.centre[2] + Math.sin(this.elevation) * this.distance);
    this.camera.lookAt(...this.centre);
    this.camera.updateMatrixWorld();
  }

  turn(azimuth: number, elevation: number) {
    this.azimuth += azimuth;
    this.elevation = Math.min(1.5, Math.max(-1.5, this.elevation + elevation));
    this.changed();
  }

  nearer(factor: number) {
    this.distance = Math.min(1e4, Math.max(1e-3, this.distance * factor));
    this.changed();
  }

  key(event: KeyboardEvent): boolean {
    const turns: Record<string, () => void> = {
      ArrowLeft: () => this.turn(-0.1, 0),
      ArrowRight: () => this.turn(0.1, 0),
      ArrowUp: () => this.turn(0, 0.1),
      ArrowDown: () => this.turn(0, -0.1),
      '+': () => this.nearer(0.85),
      '=': () => this.nearer(0.85),
      '-': () => this.nearer(1 / 0.85),
    };
    const turn = turns[event.key];
    if (!turn || event.ctrlKey || event.metaKey || event.altKey) return false;
    event.preventDefault();
    turn();
    return true;
  }

  listen(element: HTMLElement) {
    let last: PointerEvent | null = null;
    element.addEventListener('pointerdown', e => {
      last = e;
      element.setPointerCapture(e.pointerId);
    });
    element.addEventListener('pointermove', e => {
      if (!last) return;
      this.turn((last.clientX - e.clientX) * 0.008, (e.clientY - last.clientY) * 0.008);
      last = e;
    });
    const stop = () => { last = null; };
    element.addEventListener('pointerup', stop);
    element.addEventListener('pointercancel', stop);
    // The bare wheel scrolls the page.
    element.addEventListener('wheel', e => {
      if (!e.ctrlKey) return;
      e.preventDefault();
      this.nearer(e.deltaY > 0 ? 1.1 : 1 / 1.1);
    }, {passive: false});
  }
}
