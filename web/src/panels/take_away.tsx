// Panel 8: files and commands.
import type {ModelData, PageData} from '../page_data';
import {fileAddress} from '../server';
import {compared, current, useStore} from '../state';
import {Command, Empty, Panel} from './panel';

export function TakeAway({page}: {page: PageData}) {
  const model = page.models[useStore(current)];
  const other = useStore(compared);
  const shown = other === null || page.models[other] === model ? [model] : [model, page.models[other]];
  return (
    <Panel id="take-away" title="8 Take away" wide
      how="Files of the models that are shown, in SI units; the URDF has the identified values, the CSV what was measured and predicted.">
      {shown.map(m => <Files key={m.id} page={page} model={m} />)}
      <h3>What made this page</h3>
      <Command text={page.command} label="command that made this page" />
      <h3>What to do next</h3>
      {model.nextCommand ? <Command text={model.nextCommand} label="next command" /> : <p>Nothing: there is nothing left to add.</p>}
      <p class="note">{page.program} {page.version}</p>
    </Panel>
  );
}

function Files({page, model}: {page: PageData; model: ModelData}) {
  const offered = model.files.filter(f => page.live || f.text !== null);
  return (
    <>
      <h3>{model.title}</h3>
      {offered.length
        ? <ul class="files" aria-label={`Files of ${model.title}`}>{offered.map(f => <li key={f.name}><FileLink page={page} model={model} file={f} /></li>)}</ul>
        : <Empty>This page holds no files of {model.title}: {page.program} --out DIR writes them beside it.</Empty>}
    </>
  );
}

function FileLink({page, model, file}: {page: PageData; model: ModelData; file: ModelData['files'][number]}) {
  if (page.live) {
    return <a href={fileAddress(model.id, file.name)} download={file.name}>{file.name}</a>;
  }
  const save = () => {
    const url = URL.createObjectURL(new Blob([file.text!], {type: file.type}));
    const link = document.createElement('a');
    link.href = url;
    link.download = file.name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  };
  return <button type="button" onClick={save}>{file.name}<span class="note"> {size(file.text!)}</span></button>;
}

function size(text: string): string {
  const bytes = new Blob([text]).size;
  return bytes < 2048 ? `${bytes} B` : `${Math.round(bytes / 1024)} KiB`;
}
