// Panel 8: files and commands.
import {useRef} from 'preact/hooks';
import {errorsOver} from '../data';
import {fmt, fmtTimes, unitText} from '../format';
import type {ModelData, PageData, WholeRunsData} from '../page_data';
import {fileAddress} from '../server';
import {compared, current, useStore} from '../state';
import {Command, Empty, Panel} from './panel';
import {interval} from './parameters';

export function TakeAway({page}: {page: PageData}) {
  const m = useStore(current), c = useStore(compared);
  // Of a search also the model in which it ended.
  const final = page.conclusion ? [page.models.length - 1] : [];
  const shown = [...new Set([m, ...(c === null ? [] : [c]), ...final])].map(i => page.models[i]);
  return (
    <Panel id="take-away" title="8 Take away" wide
      how="Files of the models that are shown, in SI units; the URDF has the identified values, the CSV what was measured and predicted.">
      {shown.map(model => <Files key={model.id} page={page} model={model} />)}
      <h3>What made this page</h3>
      <Command text={page.command} label="command that made this page" />
      <h3>What to do next</h3>
      {page.models[m].nextCommand ? <Command text={page.models[m].nextCommand} label="next command" /> : <p>Nothing: there is nothing left to add.</p>}
      <p class="note">{page.program} {page.version}</p>
    </Panel>
  );
}

const kUrdf = 'identified.urdf', kYaml = 'identified.sysid.yaml';

function Files({page, model}: {page: PageData; model: ModelData}) {
  const box = useRef<HTMLDivElement>(null);
  const offered = model.files.filter(f => page.live || f.text !== null);
  const names = offered.map(f => f.name);
  // As a reader would press one after the other.
  const both = () => box.current?.querySelectorAll<HTMLElement>('[data-pair]').forEach(e => e.click());
  return (
    <div ref={box}>
      <h3>{model.title}</h3>
      {offered.length ? <>
        <p class="note">{page.live && model.wholeRuns
          ? 'These files are not of the fit over segments that the page shows, but of one more, of one trajectory over each whole run, as sysid_fit makes it.'
          : `Errors and values in these files are those that the page shows for this model, ${errorsOver(model)}.`}</p>
        <ul class="files" aria-label={`Files of ${model.title}`}>{offered.map(f => <li key={f.name}><FileLink page={page} model={model} file={f} /></li>)}</ul>
        {names.includes(kUrdf) && names.includes(kYaml) && <p>
          <button type="button" onClick={both}>Save the URDF and its YAML</button>{' '}
          <span class="note">The two belong together: what is free, its start and the effects stand in {kYaml}, which sysid_fit --model {kUrdf} reads beside it. Keep these names.</span>
        </p>}
        {page.live && model.wholeRuns && <WholeRuns model={model} whole={model.wholeRuns} />}
      </> : <Empty>This page holds no files of {model.title}: {page.program} --out DIR writes them beside it.</Empty>}
    </div>
  );
}

// What is in the files, beside what the other panels say.
function WholeRuns({model, whole}: {model: ModelData; whole: WholeRunsData}) {
  const shown = (name: string) => model.parameters.find(p => p.name === name);
  return (
    <div class="table-scroll"><table>
      <caption>{model.title}: values on this page and in the files</caption>
      <thead><tr><th scope="col" /><th scope="col">unit</th><th scope="col" class="number">here, over segments</th><th scope="col" class="number">in the files, over whole runs</th><th scope="col" class="number">95 % interval</th></tr></thead>
      <tbody>
        <tr><th scope="row">error of fitted runs</th><td>× noise</td><td class="number">{fmtTimes(model.trainError)}</td><td class="number">{fmtTimes(whole.trainError)}</td><td class="number">–</td></tr>
        <tr><th scope="row">error of held-out runs</th><td>× noise</td><td class="number">{fmtTimes(model.holdoutError)}</td><td class="number">{fmtTimes(whole.holdoutError)}</td><td class="number">–</td></tr>
        {whole.parameters.map(p => <tr key={p.name}><th scope="row">{p.name}</th><td>{unitText(p.unit) || '–'}</td>
          <td class="number">{fmt(shown(p.name)?.value, 6)}</td><td class="number">{fmt(p.value, 6)}</td>
          <td class="number">{interval({ci95: p.ci95, lower: shown(p.name)?.lower ?? null, upper: shown(p.name)?.upper ?? null})}</td></tr>)}
      </tbody>
    </table></div>
  );
}

function FileLink({page, model, file}: {page: PageData; model: ModelData; file: ModelData['files'][number]}) {
  const pair = file.name === kUrdf || file.name === kYaml ? '' : undefined;
  if (page.live) {
    return <a href={fileAddress(model.id, file.name)} download={file.name} data-pair={pair}>{file.name}</a>;
  }
  const save = () => {
    const url = URL.createObjectURL(new Blob([file.text!], {type: file.type}));
    const link = document.createElement('a');
    link.href = url;
    link.download = file.name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  };
  return <button type="button" onClick={save} data-pair={pair}>{file.name}<span class="note"> {size(file.text!)}</span></button>;
}

function size(text: string): string {
  const bytes = new Blob([text]).size;
  return bytes < 2048 ? `${bytes} B` : `${Math.round(bytes / 1024)} KiB`;
}
