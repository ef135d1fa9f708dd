// What the user looks at. A store is a value with listeners: what changes many
// times a second (the cursor) is listened to by the plots, without rendering.
import {useEffect, useReducer} from 'preact/hooks';
import {duration} from './data';
import type {PageData, StudioEvent} from './page_data';

export class Store<T> {
  private listeners = new Set<(value: T) => void>();
  constructor(private current: T) {}
  get value(): T { return this.current; }
  set(value: T) {
    if (Object.is(value, this.current)) return;
    this.current = value;
    for (const listener of [...this.listeners]) listener(value);
  }
  subscribe(listener: (value: T) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}

export function useStore<T>(store: Store<T>): T {
  const [, render] = useReducer<number, void>(n => n + 1, 0);
  const rendered = store.value;
  useEffect(() => {
    // What was said between the drawing and this is not lost.
    if (!Object.is(store.value, rendered)) render();
    return store.subscribe(() => render());
  }, [store]);
  return rendered;
}

export const page = new Store<PageData | null>(null);
export const run = new Store(0);
export const current = new Store(0); // index into PageData.models
export const compared = new Store<number | null>(null);
export const joint = new Store(0); // index into MechanismData.joints
export const cursor = new Store(0); // s
export const zoom = new Store<[number, number] | null>(null); // s; null: all
export const playing = new Store(false);
export const speed = new Store(1);
export const studio = new Store<StudioEvent>({type: 'idle'});
export const connection = new Store<'none' | 'open' | 'lost'>('none');
export const printing = new Store(false);

// Panels of which only the heading is shown, by their ids; a reload keeps them.
export const folded = new Store<ReadonlySet<string>>(storedFolds());
folded.subscribe(ids => {
  try { localStorage.setItem('sysid-folded', [...ids].join(' ')); } catch { /* from disk */ }
});

export function fold(id: string, on: boolean) {
  const next = new Set(folded.value);
  if (on) next.add(id); else next.delete(id);
  folded.set(next);
}

function storedFolds(): ReadonlySet<string> {
  try {
    return new Set((localStorage.getItem('sysid-folded') ?? '').split(' ').filter(Boolean));
  } catch {
    return new Set();
  }
}

export type Theme = 'light' | 'dark';
export const theme = new Store<Theme>('light');

export function shownRange(): [number, number] {
  if (zoom.value) return zoom.value;
  return page.value?.runs.length ? duration(page.value.runs[run.value]) : [0, 1];
}

export function setCursor(t: number) {
  if (!page.value || !page.value.runs.length) return;
  const [t0, t1] = duration(page.value.runs[run.value]);
  cursor.set(Math.min(Math.max(t, t0), t1));
}

// Keeps what is shown within the run; a range that holds all of it is none.
export function setZoom(range: [number, number] | null) {
  if (!range || !page.value) return zoom.set(null);
  const [t0, t1] = duration(page.value.runs[run.value]);
  const width = Math.min(range[1] - range[0], t1 - t0);
  if (!(width > 0) || width >= (t1 - t0) * 0.9999) return zoom.set(null);
  const start = Math.min(Math.max(range[0], t0), t1 - width);
  zoom.set([start, start + width]);
}

// Below 1 is nearer; around the cursor where it is in sight.
export function zoomBy(factor: number) {
  const [a, b] = shownRange();
  const centre = cursor.value >= a && cursor.value <= b ? cursor.value : (a + b) / 2;
  setZoom([centre - (centre - a) * factor, centre + (b - centre) * factor]);
}

export function panBy(fraction: number) {
  const [a, b] = shownRange();
  const d = (b - a) * fraction;
  if (zoom.value) setZoom([a + d, b + d]);
}

export function setRun(index: number) {
  run.set(index);
  zoom.set(null);
  setCursor(cursor.value);
}

// The keys of every plot over time.
export function timeKey(event: KeyboardEvent) {
  const [a, b] = shownRange();
  const step = (b - a) / (event.shiftKey ? 20 : 200);
  const actions: Record<string, () => void> = {
    ArrowLeft: () => setCursor(cursor.value - step),
    ArrowRight: () => setCursor(cursor.value + step),
    Home: () => setCursor(a),
    End: () => setCursor(b),
    '+': () => zoomBy(0.5),
    '=': () => zoomBy(0.5),
    '-': () => zoomBy(2),
    '0': () => setZoom(null),
    ' ': () => playing.set(!playing.value),
  };
  const action = actions[event.key];
  if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  action();
}

// A new document: the first, or after a fit (what is seen stays where it can).
export function showPage(data: PageData, model?: number) {
  const first = !page.value?.models.length;
  const index = model === undefined ? -1 : data.models.findIndex(m => m.id === model);
  page.set(data);
  if (first || index >= 0) {
    compared.set(first ? data.compared : current.value);
    current.set(index >= 0 ? index : data.current);
  }
  current.set(Math.min(current.value, Math.max(0, data.models.length - 1)));
  if (compared.value !== null && compared.value >= data.models.length) compared.set(null);
  if (run.value >= data.runs.length) run.set(0);
  setCursor(cursor.value);
}

function playLoop() {
  let last = 0;
  const step = (now: number) => {
    if (!playing.value) return;
    const [a, b] = shownRange();
    const next = cursor.value + (last ? (now - last) / 1000 : 0) * speed.value;
    last = now;
    setCursor(next > b || next < a ? a : next);
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}
playing.subscribe(on => { if (on) playLoop(); });

// The theme that was chosen, else the system's; paper is always light.
export function startTheme() {
  const dark = matchMedia('(prefers-color-scheme: dark)');
  let chosen = stored();
  const apply = () => {
    theme.set(printing.value ? 'light' : chosen ?? (dark.matches ? 'dark' : 'light'));
    document.documentElement.dataset.theme = theme.value;
    document.documentElement.classList.toggle('printing', printing.value);
  };
  dark.addEventListener('change', apply);
  printing.subscribe(apply);
  addEventListener('beforeprint', () => printing.set(true));
  addEventListener('afterprint', () => printing.set(false));
  matchMedia('print').addEventListener('change', e => printing.set(e.matches));
  apply();
  return () => {
    chosen = theme.value === 'dark' ? 'light' : 'dark';
    try { localStorage.setItem('sysid-theme', chosen); } catch { /* from disk */ }
    apply();
  };
}

function stored(): Theme | null {
  try {
    const value = localStorage.getItem('sysid-theme');
    return value === 'dark' || value === 'light' ? value : null;
  } catch {
    return null;
  }
}
