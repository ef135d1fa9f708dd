// sysid_studio behind the page: its document, its events, its requests.
import {checked} from './data';
import type {PageData, StudioEvent} from './page_data';
import {connection, page, showPage, Store, studio} from './state';

const kRetry_ms = 2000;

// What the last request said, where it was refused.
export const refusal = new Store<string>('');

export async function fetchPage(): Promise<PageData> {
  const answer = await fetch('/api/page');
  if (!answer.ok) throw new Error(await reason(answer));
  return checked(await answer.json());
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
export function follow(lost = false) {
  let wasRunning = false;
  const source = new EventSource('/api/events');
  source.onopen = () => {
    connection.set('open');
    if (lost) void refresh();
    lost = false;
  };
  source.onmessage = message => {
    const event = JSON.parse(message.data) as StudioEvent;
    if (event.type === 'done') void refresh(event.model);
    // The end came while nobody listened.
    else if (event.type === 'idle' && wasRunning) void refresh();
    wasRunning = event.type === 'progress';
    studio.set(event);
  };
  source.onerror = () => {
    connection.set('lost');
    lost = true;
    // A closed source does not come again by itself.
    if (source.readyState === EventSource.CLOSED) setTimeout(() => follow(true), kRetry_ms);
  };
}

async function refresh(model?: number) {
  try {
    showPage(await fetchPage(), model);
  } catch {
    connection.set('lost');
  }
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
