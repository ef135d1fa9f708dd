// sysid_studio behind the page: its document, its events, its requests.
import {checked} from './data';
import type {PageData, StudioEvent} from './page_data';
import {connection, page, showPage, Store, studio} from './state';

const kRetry_ms = 2000;

// What the last request said, where it was refused.
export const refusal = new Store<string>('');

let lastText = '', last: PageData | null = null;

// The same object where nothing has changed, so that nothing is drawn again.
export async function fetchPage(): Promise<PageData> {
  const answer = await fetch('/api/page');
  if (!answer.ok) throw new Error(await reason(answer));
  const text = await answer.text();
  if (!last || text !== lastText) last = checked(JSON.parse(text));
  lastText = text;
  return last;
}

async function reason(answer: Response): Promise<string> {
  try {
    const {error, hint} = await answer.json();
    return hint ? `${error} (${hint})` : error;
  } catch {
    return `the server answered ${answer.status}`;
  }
}

// Follows the server for as long as the page is open.
export function follow() {
  let wasRunning = false, fresh = true;
  const source = new EventSource('/api/events');
  source.onopen = () => {
    connection.set('open');
    fresh = true;
  };
  source.onmessage = message => {
    const event = JSON.parse(message.data) as StudioEvent;
    if (event.type === 'done') refresh(event.model);
    // A fit may have ended while nobody listened.
    else if (fresh || (event.type === 'idle' && wasRunning)) refresh();
    fresh = false;
    wasRunning = event.type === 'progress';
    studio.set(event);
  };
  source.onerror = () => {
    connection.set('lost');
    // A closed source does not come again by itself.
    if (source.readyState === EventSource.CLOSED) setTimeout(follow, kRetry_ms);
  };
}

let turn = Promise.resolve();

// One after the other, lest an older document replaces a newer one.
function refresh(model?: number) {
  turn = turn.then(async () => {
    try {
      showPage(await fetchPage(), model);
    } catch {
      connection.set('lost');
    }
  });
}

export function isRunning(event: StudioEvent): boolean {
  return event.type === 'progress';
}

async function post(path: string, body: object) {
  refusal.set('');
  try {
    const answer = await fetch(path, {
      method: 'POST',
      headers: {'Content-Type': 'application/json'},
      body: JSON.stringify(body),
    });
    if (!answer.ok) refusal.set(await reason(answer));
  } catch {
    refusal.set('The server does not answer; is sysid_studio still running?');
  }
}

export const add = (model: number, effect: string) => post('/api/add', {model, effect});
export const remove = (model: number, effect: string) => post('/api/remove', {model, effect});
// Of the model as given, where there is none.
export const start = () => post('/api/start', {});
export const cancel = () => post('/api/cancel', {});

export function fileAddress(model: number, name: string): string {
  return `/api/models/${model}/${encodeURIComponent(name)}`;
}

export const isLive = () => page.value?.live === true;
