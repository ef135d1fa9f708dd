// A fit that runs, or how the last one ended.
import {fmtSeconds, fmtTimes} from '../format';
import type {StudioEvent} from '../page_data';
import {cancel, isRunning, refusal, start} from '../server';
import {studio, useStore} from '../state';

export function Progress({event}: {event: StudioEvent}) {
  switch (event.type) {
    case 'progress':
      return (
        <div class="progress" role="group" aria-label="Fit in progress">
          <p role="status"><strong>{event.title}</strong>: {event.doing}, {fmtSeconds(event.elapsed_s)}
            {event.of > 0 && `, iteration ${event.iteration} of at most ${event.of}`}
            {event.error !== null && `, error ${fmtTimes(event.error)}`}</p>
          <progress max={event.of || undefined} value={event.of ? event.iteration : undefined} aria-label={event.title} />
          <button type="button" onClick={() => void cancel()}>Cancel</button>
        </div>
      );
    case 'cancelled': return <p class="warning" role="status">The fit was cancelled; the models are as before.</p>;
    case 'failed': return <p class="warning" role="alert">The fit failed: {event.error}{event.hint && ` (${event.hint})`}</p>;
    case 'done': return <p role="status">Done: the new model is shown.</p>;
    default: return null;
  }
}

// Before there is a model: the first fit runs, or was cancelled.
export function FirstFit() {
  const event = useStore(studio), said = useStore(refusal);
  return (
    <main id="main" tabIndex={-1}>
      <section class="panel" aria-labelledby="first-title">
        <h2 id="first-title">The first fit</h2>
        <p class="how">There is no model yet: the model as given is fitted first, and then shown here.</p>
        <Progress event={event} />
        {said && <p class="warning" role="alert">{said}</p>}
        {!isRunning(event) && <button type="button" class="primary" onClick={() => void start()}>Fit the model as given</button>}
      </section>
    </main>
  );
}
