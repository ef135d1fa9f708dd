// A fit that runs, or how the last one ended.
import {useEffect, useRef, useState} from 'preact/hooks';
import {fmtSeconds, fmtTimes} from '../format';
import type {StudioEvent} from '../page_data';
import {cancel, isRunning, refusal, start} from '../server';
import {studio, useStore} from '../state';

const kTick_ms = 200;

type Running = Extract<StudioEvent, {type: 'progress'}>;

export function Progress({event}: {event: StudioEvent}) {
  switch (event.type) {
    case 'progress': return <Running event={event} />;
    case 'cancelled': return <p class="warning" role="status">The fit was cancelled; the models are as before.</p>;
    case 'failed': return <p class="warning" role="alert">The fit failed: {event.error}{event.hint && ` (${event.hint})`}</p>;
    case 'done': return <p role="status">Done: the new model is shown.</p>;
    default: return null;
  }
}

function Running({event}: {event: Running}) {
  const box = useRef<HTMLDivElement>(null);
  // A bound that was passed was none.
  const bounded = event.of > 0 && event.iteration <= event.of;
  const stop = () => {
    // The button goes away, and would take the focus with it.
    box.current?.closest<HTMLElement>('.panel, .top')?.focus();
    void cancel();
  };
  return (
    <div class="progress" role="group" aria-label="Fit in progress" ref={box}>
      <p><span role="status"><strong>{event.title}</strong>: {event.doing}</span>, <Clock event={event} />
        {event.iteration > 0 && `, iteration ${event.iteration}`}{event.iteration > 0 && bounded && ` of at most ${event.of}`}
        {event.error !== null && `, error ${fmtTimes(event.error)}`}</p>
      <progress max={bounded ? event.of : undefined} value={bounded ? event.iteration : undefined} aria-label={event.title} />
      <button type="button" onClick={stop}>Cancel</button>
    </div>
  );
}

// The time that passes, also while nothing is reported.
function Clock({event}: {event: Running}) {
  const [now, setNow] = useState(() => performance.now());
  const last = useRef({event, at: now});
  if (last.current.event !== event) last.current = {event, at: performance.now()};
  useEffect(() => {
    const timer = setInterval(() => setNow(performance.now()), kTick_ms);
    return () => clearInterval(timer);
  }, []);
  return <>{fmtSeconds(event.elapsed_s + Math.max(0, now - last.current.at) / 1000)}</>;
}

// Above all panels, wherever the page is scrolled to.
export function StudioProgress() {
  const event = useStore(studio), said = useStore(refusal);
  return <>
    <Progress event={event} />
    {said && <p class="warning" role="alert">{said}</p>}
  </>;
}

// Before there is a model: the first fit runs, or was cancelled.
export function FirstFit() {
  const event = useStore(studio), said = useStore(refusal);
  return (
    <main id="main" tabIndex={-1}>
      <section class="panel" tabIndex={-1} aria-labelledby="first-title">
        <h2 id="first-title">The first fit</h2>
        <p class="how">There is no model yet: the model as given is fitted first, and then shown here.</p>
        <Progress event={event} />
        {said && <p class="warning" role="alert">{said}</p>}
        {!isRunning(event) && <button type="button" class="primary" onClick={() => void start()}>Fit the model as given</button>}
      </section>
    </main>
  );
}
