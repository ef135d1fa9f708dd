// What every panel has: a heading, and a sentence on how to read it.
import {Component, type ComponentChildren} from 'preact';
import {useState} from 'preact/hooks';
import {fold, folded, printing, useStore} from '../state';

export function Panel({id, title, how, wide, children}: {
  id: string; title: string; how: ComponentChildren; wide?: boolean; children: ComponentChildren;
}) {
  const closed = useStore(folded).has(id), open = useStore(printing) || !closed;
  return (
    <section id={id} class={wide ? 'panel wide' : 'panel'} tabIndex={-1} aria-labelledby={`${id}-title`}>
      <div class="head">
        <h2 id={`${id}-title`}>{title}</h2>
        <button type="button" class="fold" aria-expanded={!closed} onClick={() => fold(id, !closed)}>{closed ? 'Unfold' : 'Fold'}<span class="hidden"> {title}</span></button>
      </div>
      {open && <>
        <p class="how">{how}</p>
        {children}
      </>}
    </section>
  );
}

// A panel that fails says so; the others stay.
export class Guard extends Component<{children: ComponentChildren}, {failure: string}> {
  state = {failure: ''};
  componentDidCatch(error: unknown) {
    console.error(error);
    this.setState({failure: error instanceof Error ? error.message : String(error)});
  }
  render() {
    if (!this.state.failure) return this.props.children;
    return <p class="warning" role="alert">A panel cannot be shown: {this.state.failure}.</p>;
  }
}

// In place of a panel's figure, why there is none.
export function Empty({children}: {children: ComponentChildren}) {
  return <p class="empty">{children}</p>;
}

export function Choice<T extends string | number>({label, short, value, options, onChange}: {
  label: string; short?: string; value: T; options: {value: T; text: string; title?: string}[]; onChange: (value: T) => void;
}) {
  return (
    <label class="choice">
      <span>{short ?? label}</span>
      <select aria-label={label} value={String(value)} onChange={e => {
        const text = (e.currentTarget as HTMLSelectElement).value;
        const option = options.find(o => String(o.value) === text);
        if (option) onChange(option.value);
      }}>
        {options.map(o => <option key={o.value} title={o.title} value={String(o.value)} selected={o.value === value}>{o.text}</option>)}
      </select>
    </label>
  );
}

// A command for the shell, with a button that copies it.
export function Command({text, label}: {text: string; label: string}) {
  const [said, say] = useState('');
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(text);
      say('copied');
    } catch {
      say(copyOldWay(text) ? 'copied' : 'select it and copy');
    }
    setTimeout(() => say(''), 2000);
  };
  return (
    <div class="command">
      <pre tabIndex={0} aria-label={label}><code>{text}</code></pre>
      <button type="button" onClick={copy}>Copy<span class="hidden"> {label}</span></button>
      <span role="status">{said}</span>
    </div>
  );
}

// Where there is no clipboard: a page opened from disk in some browsers.
function copyOldWay(text: string): boolean {
  const area = document.createElement('textarea');
  area.value = text;
  document.body.append(area);
  area.select();
  const done = document.execCommand('copy');
  area.remove();
  return done;
}

export interface Column<Row> {
  name: string;
  key: string;
  unit?: string;
  sort?: (row: Row) => number | string | null;
  cell: (row: Row) => ComponentChildren;
  number?: boolean;
}

// A table; columns with `sort` have a button in their head.
export function DataTable<Row>({caption, columns, rows, rowKey, detail}: {
  caption: string; columns: Column<Row>[]; rows: Row[]; rowKey: (row: Row) => string;
  detail?: (row: Row) => ComponentChildren;
}) {
  const [order, setOrder] = useState<{key: string; down: boolean} | null>(null);
  // Chromium repeats no buttons in the head of a table's next page.
  const paper = useStore(printing);
  const column = columns.find(c => c.key === order?.key);
  const sorted = column?.sort ? sortedBy(rows, column.sort, order!.down) : rows;
  const press = (key: string) =>
    setOrder(order?.key !== key ? {key, down: false} : order.down ? null : {key, down: true});
  return (
    <div class="table-scroll" role="region" aria-label={caption} tabIndex={0}>
      <table>
        <caption>{caption}</caption>
        <thead>
          <tr>{columns.map(c => (
            <th key={c.key} scope="col" class={c.number ? 'number' : ''}
              aria-sort={!c.sort ? undefined : order?.key !== c.key ? 'none' : order.down ? 'descending' : 'ascending'}>
              {c.sort && !paper ? (
                <button type="button" class="sort" onClick={() => press(c.key)}>
                  {c.name}<span aria-hidden="true">{order?.key !== c.key ? ' ↕' : order.down ? ' ↓' : ' ↑'}</span>
                </button>
              ) : c.name}
              {c.unit && <span class="unit">{c.unit}</span>}
            </th>
          ))}</tr>
        </thead>
        {sorted.map(row => {
          const more = detail?.(row);
          return (
            <tbody key={rowKey(row)}>
              <tr>{columns.map((c, i) => i === 0
                ? <th key={c.key} scope="row">{c.cell(row)}</th>
                : <td key={c.key} class={c.number ? 'number' : ''}>{c.cell(row)}</td>)}</tr>
              {more && <tr class="detail"><td colSpan={columns.length}>{more}</td></tr>}
            </tbody>
          );
        })}
      </table>
    </div>
  );
}

// Rows without a value come last, in either direction.
function sortedBy<Row>(rows: Row[], key: (row: Row) => number | string | null, down: boolean): Row[] {
  const sign = down ? -1 : 1;
  return [...rows].sort((a, b) => {
    const x = key(a), y = key(b);
    if (x === null || y === null) return Number(x === null) - Number(y === null);
    return x < y ? -sign : x > y ? sign : 0;
  });
}
