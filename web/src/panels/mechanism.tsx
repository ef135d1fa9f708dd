// Panel 3: the mechanism at the time cursor.
import {useEffect, useRef, useState} from 'preact/hooks';
import {fmt, list} from '../format';
import {ErrorScale} from '../plots/heat_map';
import {MechanismScene} from '../plots/scene';
import type {PageData} from '../page_data';
import {current, cursor, playing, printing, run, theme, useStore} from '../state';
import {Choice, Empty, Panel} from './panel';

const kHow = 'Solid is what was measured, coloured by how large the error of each joint is at this time; the orange ghost is what the model predicts. '
  + 'Drag or use the arrow keys to turn it; + and - come nearer and go farther; space plays. Without a measurement of a joint, the solid one follows the prediction.';

export function Mechanism({page}: {page: PageData}) {
  const canvas = useRef<HTMLCanvasElement>(null);
  const scene = useRef<MechanismScene | null>(null);
  const [failure, setFailure] = useState('');
  const [info, setInfo] = useState({grid: 0, meshes: [] as string[], min: 1, max: 1});
  const [exaggeration, setExaggeration] = useState(1);
  const r = useStore(run), m = useStore(current);
  const urdf = page.mechanism.urdf;

  useEffect(() => {
    try {
      scene.current = new MechanismScene(canvas.current!, page);
    } catch (error) {
      setFailure(why(error));
      return;
    }
    const made = scene.current;
    const view = canvas.current!.parentElement!;
    const resize = () => {
      const width = view.clientWidth;
      if (width) made.resize(width, Math.min(560, Math.max(320, width * 0.6)));
    };
    const observer = new ResizeObserver(resize);
    observer.observe(view);
    resize();
    const stop = [
      cursor.subscribe(t => made.at(t)),
      theme.subscribe(() => made.at(cursor.value)),
      printing.subscribe(() => made.drawNow()),
    ];
    return () => {
      observer.disconnect();
      stop.forEach(f => f());
      made.dispose();
      scene.current = null;
    };
  }, [urdf]);

  useEffect(() => {
    const made = scene.current;
    if (!made) return;
    made.show({page, model: m, run: r, exaggeration});
    made.at(cursor.value);
    setInfo({grid: made.grid, meshes: made.meshes, min: made.minError, max: made.maxError});
  }, [page, m, r, exaggeration, urdf]);

  const key = (e: KeyboardEvent) => {
    if (scene.current?.orbit.key(e)) return;
    if (e.key === ' ') {
      e.preventDefault();
      playing.set(!playing.value);
    }
  };
  if (failure) {
    return <Panel id="mechanism" title="3 Mechanism" how={kHow}><Empty>{failure}</Empty></Panel>;
  }
  return (
    <Panel id="mechanism" title="3 Mechanism" how={kHow}>
      <div class="row">
        <Choice label="Difference shown" value={exaggeration} onChange={setExaggeration}
          options={[1, 3, 10, 30, 100].map(x => ({value: x, text: x === 1 ? 'as it is' : `${x} times as large`}))} />
        <ErrorScale min={info.min} max={info.max} />
      </div>
      <div class="view">
        <canvas ref={canvas} tabIndex={0} role="img" onKeyDown={key}
          aria-label="The mechanism in 3D at the time cursor, measured and predicted. Arrow keys turn it, plus and minus change the distance, space plays." />
      </div>
      <p class="note">Squares of {fmt(info.grid)} m; z is up.
        {info.meshes.length > 0 && ` Meshes are not loaded (${list([...new Set(info.meshes)])}): rods stand in for them.`}</p>
    </Panel>
  );
}

function why(error: unknown): string {
  const text = error instanceof Error ? error.message : String(error);
  return /webgl/i.test(text)
    ? 'This browser has no WebGL, which the 3D view needs: switch on hardware acceleration, or open the page in another browser. Every other panel works without it.'
    : `The mechanism cannot be drawn: ${text}.`;
}
