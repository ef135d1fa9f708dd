// The page: its document inlined, or asked of the server.
import {render} from 'preact';
import {useEffect, useState} from 'preact/hooks';
import {inlined} from './data';
import {Add} from './panels/add';
import {Compare} from './panels/compare';
import {Controls} from './panels/controls';
import {Mechanism} from './panels/mechanism';
import {Guard} from './panels/panel';
import {FirstFit, StudioProgress} from './panels/progress';
import {Parameters} from './panels/parameters';
import {TakeAway} from './panels/take_away';
import {Verdict} from './panels/verdict';
import {Where} from './panels/where';
import {Which} from './panels/which';
import type {PageData} from './page_data';
import {fetchPage, follow} from './server';
import {connection, fold, folded, page, showPage, startTheme, theme, useStore} from './state';

const kPanels = [
  ['verdict', 'Verdict'], ['compare', 'Compare'], ['mechanism', 'Mechanism'], ['where', 'Where'],
  ['which', 'Which'], ['add', 'Add'], ['parameters', 'Parameters'], ['take-away', 'Take away'],
];
const kRetry_ms = 2000;

const toggleTheme = startTheme();

function App() {
  const data = useStore(page);
  const [failure, setFailure] = useState('');
  useEffect(() => start(setFailure), []);
  return <>
    <a class="skip" href="#main">Skip to the content</a>
    <Header data={data} />
    {failure && !data && <p class="warning" role="alert">{failure}</p>}
    {data && data.models.length > 0 && data.runs.length > 0 && <Panels data={data} />}
    {data && data.live && !data.models.length && <FirstFit />}
    {data && !data.live && !(data.models.length && data.runs.length) && <p class="warning">This document holds no fitted model and run.</p>}
  </>;
}

function Header({data}: {data: PageData | null}) {
  const dark = useStore(theme) === 'dark', link = useStore(connection);
  useEffect(() => { if (data) document.title = `${data.model}: ${data.program}`; }, [data]);
  return (
    <header>
      <h1>{data ? data.model : 'sysid'} <span class="note">{data && `${data.program} ${data.version}`}</span></h1>
      <nav aria-label="Panels"><ol>{kPanels.map(([id, name]) => <li key={id}><a href={`#${id}`} onClick={() => fold(id, false)}>{name}</a></li>)}</ol></nav>
      {data && <FoldAll />}
      <button type="button" class="theme" onClick={toggleTheme} aria-pressed={dark}>{dark ? 'Light colours' : 'Dark colours'}</button>
      {link === 'lost' && <p class="warning" role="alert">The server does not answer; what is shown stays as it was. Trying again; if it was stopped, start sysid_studio with the same --out.</p>}
    </header>
  );
}

// All but the verdict, or none.
function FoldAll() {
  const some = useStore(folded).size > 0;
  return <button type="button" class="fold-all" onClick={() => folded.set(new Set(some ? [] : kPanels.slice(1).map(([id]) => id)))}>{some ? 'Unfold all' : 'Fold all'}</button>;
}

function Panels({data}: {data: PageData}) {
  return <>
    <div class="top" id="top" tabIndex={-1}>
      <Controls page={data} />
      {data.live && <StudioProgress />}
    </div>
    <main id="main" tabIndex={-1}>
      <Guard><Verdict page={data} /></Guard>
      <div class="beside">
        <Guard><Compare page={data} /></Guard>
        <Guard><Mechanism page={data} /></Guard>
      </div>
      <Guard><Where page={data} /></Guard>
      <Guard><Which page={data} /></Guard>
      <Guard><Add page={data} /></Guard>
      <Guard><Parameters page={data} /></Guard>
      <Guard><TakeAway page={data} /></Guard>
    </main>
  </>;
}

function start(fail: (text: string) => void) {
  try {
    const data = inlined(document.getElementById('page-data')?.textContent);
    if (data) return showPage(data);
  } catch (error) {
    return fail(`The document of this page cannot be read: ${error instanceof Error ? error.message : error}`);
  }
  void live(fail);
}

// Until the server answers.
async function live(fail: (text: string) => void) {
  try {
    showPage(await fetchPage());
    follow();
  } catch (error) {
    fail(`No data in this page, and no server answers (${error instanceof Error ? error.message : error}). Trying again.`);
    setTimeout(() => void live(fail), kRetry_ms);
  }
}

render(<App />, document.getElementById('app')!);
