// The dictionary of a node: its tree, one entry in detail, watched values, and all parameters together.
import { signal } from '@preact/signals'
import { useEffect, useMemo, useRef, useState } from 'preact/hooks'
import { ask } from '../bench.js'
import { t } from '../i18n/index.js'
import { treeRows, withValues } from '../pick.js'
import { nodeId, connection } from '../state.js'
import { Button, Empty, Field, NodePicker, Panel, Refusal, Rows, useAsk } from '../ui.jsx'
import { Entry } from './entry.jsx'
import { Parameters } from './parameters.jsx'
import { Watched } from './watched.jsx'

const ROW = 26 // px
const query = signal('')
const closed = signal(new Set(['Communication']))
const chosen = signal(null)

/** The entries of the node's data sheet, and a function to read some of them again. */
function useEntries(node) {
  const [entries, setEntries] = useState(null)
  const [refused, setRefused] = useState(null)
  useEffect(() => {
    let isCurrent = true
    setEntries(null)
    setRefused(null)
    if (node !== null && connection.value === 'open') {
      ask({ do: 'objects', node }).then(
        (found) => isCurrent && setEntries(found),
        (refused) => isCurrent && setRefused(refused),
      )
    }
    return () => (isCurrent = false)
  }, [node, connection.value])
  const take = (values) => setEntries((entries) => entries && withValues(entries, values))
  return { entries, refused, take }
}

export function Objects() {
  const node = nodeId.value
  const { entries, refused, take } = useEntries(node)
  const rows = useMemo(() => treeRows(entries ?? [], query.value, closed.value), [entries, query.value, closed.value])
  const entry = entries?.find((each) => each.address === chosen.value) ?? null
  const [reading, read] = useAsk()
  const readShown = async () => {
    const addresses = rows.filter((row) => row.kind === 'entry' && row.entry.access !== 'wo').map((row) => row.key)
    const values = await read({ do: 'read', node, addresses })
    if (values) take(values)
  }
  return (
    <div class="split wide-left">
      <Panel class="fill" title={t('objects.title')} tools={<NodePicker />}>
        <div class="line">
          <Field
            class="grow"
            label={t('search')}
            type="search"
            data-test="object-search"
            value={query.value}
            placeholder={t('objects.search')}
            set={(text) => (query.value = text)}
          />
          <Button
            data-test="read-shown"
            aria-disabled={reading.busy}
            title={t('objects.read-shown.help')}
            run={readShown}
          >
            {t('objects.read-shown')}
          </Button>
        </div>
        <Refusal of={refused ?? reading.refused} />
        {entries && <Tree rows={rows} />}
        {entries && rows.length === 0 && <Empty>{t('objects.none')}</Empty>}
        {!entries && !refused && <Empty>{t('loading')}</Empty>}
      </Panel>
      <div class="stack">
        {entry ? (
          <Entry key={`${node} ${entry.address}`} node={node} entry={entry} entries={entries} take={take} />
        ) : (
          <Panel title={t('entry.title')}>
            <Empty>{t('entry.none')}</Empty>
          </Panel>
        )}
        <Watched />
        {node !== null && <Parameters key={node} node={node} show={(address) => (chosen.value = address)} />}
      </div>
    </div>
  )
}

function Tree({ rows }) {
  const at = rows.findIndex((row) => row.key === chosen.value)
  const list = useRef(null)
  const choose = (row) => row && (chosen.value = row.key)
  const fold = (key, isOpen) => {
    const next = new Set(closed.value)
    if (isOpen) next.delete(key)
    else next.add(key)
    closed.value = next
  }
  const keys = (event) => {
    const row = rows[at]
    const next = {
      ArrowDown: at + 1,
      ArrowUp: Math.max(0, at - 1),
      Home: 0,
      End: rows.length - 1,
      PageDown: Math.min(rows.length - 1, at + 20),
      PageUp: Math.max(0, at - 20),
    }[event.key]
    if (next !== undefined) choose(rows[next])
    else if (event.key === 'ArrowRight' && row && row.kind !== 'entry') fold(row.key, true)
    else if (event.key === 'ArrowLeft' && row && row.kind !== 'entry' && row.isOpen) fold(row.key, false)
    else if (event.key === 'ArrowLeft' && row) choose(rows.slice(0, at).findLast((each) => each.level < row.level))
    else if (event.key === 'Enter')
      /** @type {HTMLElement | null} */ (document.querySelector('[data-test=object-value]'))?.focus()
    else return
    event.preventDefault()
  }
  return (
    <div class="tree" ref={list}>
      <div class="tree-row head" aria-hidden="true">
        <span>{t('entry.address')}</span>
        <span>{t('entry.name')}</span>
        <span>{t('entry.value')}</span>
        <span>{t('entry.access')}</span>
      </div>
      <Rows
        role="tree"
        aria-label={t('objects.title')}
        tabindex={0}
        aria-activedescendant={at >= 0 ? `row-${rows[at].key}` : undefined}
        onKeyDown={keys}
        count={rows.length}
        height={ROW}
        toRow={at}
        row={(index, style) => (
          <TreeRow
            key={rows[index].key}
            row={rows[index]}
            style={style}
            isChosen={index === at}
            choose={() => {
              choose(rows[index])
              if (rows[index].kind !== 'entry') fold(rows[index].key, !rows[index].isOpen)
            }}
          />
        )}
      />
    </div>
  )
}

function TreeRow({ row, style, isChosen, choose }) {
  const common = {
    id: `row-${row.key}`,
    role: /** @type {'treeitem'} */ ('treeitem'),
    style,
    onClick: choose,
    'aria-level': row.level,
    'aria-selected': isChosen,
    class: `tree-row ${row.kind} level-${row.level}`,
  }
  if (row.kind !== 'entry') {
    return (
      <div
        {...common}
        aria-expanded={row.isOpen}
        data-test={row.kind === 'group' ? `group-${row.key}` : `object-${row.key}`}
      >
        <span>
          {row.isOpen ? '▾' : '▸'} {row.kind === 'object' && <code>{row.key}</code>}
        </span>
        <span>
          {row.name} <small>{row.count}</small>
        </span>
      </div>
    )
  }
  const { entry } = row
  return (
    <div {...common} data-test={`object-${entry.address}`}>
      <code>{entry.address}</code>
      <span title={entry.name}>{entry.name}</span>
      <span class={entry.value?.is_error ? 'error' : 'value'} title={entry.value?.text}>
        {entry.value?.text ?? ''}
      </span>
      <small>{entry.access}</small>
    </div>
  )
}
