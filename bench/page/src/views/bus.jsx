// The bus as a whole: its load, what is wrong, and the frames by COB-ID.
import { send } from '../bench.js'
import { useState } from 'preact/hooks'
import { clock, ms, number, percent, NONE } from '../format.js'
import { t } from '../i18n/index.js'
import { goTo, view } from '../state.js'
import { Button, Empty, Meter, Panel, RowLink, Rows } from '../ui.jsx'
import { Fact } from './nodes.jsx'

/** @import * as wire from '../wire' */

/**
 * @import { ComponentChildren } from 'preact'
 * @import { Rate } from '../wire'
 */

export function Bus() {
  const bus = view.bus.value
  return (
    <div class="split wide-right">
      <div class="stack">
        <Panel title={`${t('bus.title')} ${bus.name}`} data-test="bus">
          <div class="load">
            <Meter percent={bus.load_percent} label={t('bus.load')} />
            <b data-test="bus-load">{percent(bus.load_percent)}</b>
          </div>
          <dl class="facts">
            <Fact name={t('bus.state')}>
              <span data-test="bus-state">{bus.state || t('unknown')}</span>
            </Fact>
            <Fact name={t('bus.bit-rate')}>
              {bus.bit_rate === null ? NONE : `${number(bus.bit_rate / 1000)} kbit/s`}
            </Fact>
            <Fact name={t('bus.peak')}>{percent(bus.load_percent_peak)}</Fact>
            <Fact name={t('bus.rate')}>{t('per-second', { count: number(bus.frames_per_second) })}</Fact>
            <Fact name={t('bus.frames')}>{number(bus.frames)}</Fact>
            <Fact name={t('bus.missing')}>
              <span class={bus.missing_frames > 0 ? 'error' : ''}>{number(bus.missing_frames)}</span>
            </Fact>
            <Fact name={t('bus.writable')}>{t(bus.is_writable ? 'yes' : 'no')}</Fact>
          </dl>
        </Panel>
        <Panel title={t('bus.troubles')}>
          {bus.troubles.length === 0 ? <Empty>{t('bus.no-troubles')}</Empty> : <Troubles troubles={bus.troubles} />}
        </Panel>
        <Panel title={t('bus.sdo')}>
          <SdoTimes nodes={view.nodes.value} />
        </Panel>
      </div>
      <Panel class="fill" title={t('bus.ids', { count: bus.ids.length })}>
        <Ids ids={bus.ids} />
      </Panel>
    </div>
  )
}

/** @param {{ troubles: wire.Trouble[] }} props */
function Troubles({ troubles }) {
  return (
    <ul class="faults" data-test="troubles">
      {troubles.map((trouble) => (
        <li key={`${trouble.since} ${trouble.text}`}>
          <time>{clock(trouble.since)}</time>
          {trouble.node !== null && (
            <Button class="link" run={() => goTo('nodes', trouble.node)}>
              {t('node')} {trouble.node}
            </Button>
          )}
          <span class={trouble.is_over ? 'over' : ''}>{trouble.text}</span> <RowLink row={trouble.row} />
        </li>
      ))}
      {troubles.some((trouble) => trouble.is_over) && (
        <li>
          <Button data-test="acknowledge" title={t('bus.acknowledge.help')} run={() => send({ do: 'acknowledge' })}>
            {t('bus.acknowledge')}
          </Button>
        </li>
      )}
    </ul>
  )
}

/** @param {{ nodes: wire.Node[] }} props */
function SdoTimes({ nodes }) {
  const most = Math.max(1, ...nodes.map((node) => node.sdo_ms ?? 0))
  return (
    <table class="grid" data-test="sdo-times">
      <tbody>
        {nodes.map((node) => (
          <tr key={node.id}>
            <td class="number">{node.id}</td>
            <td>{node.name}</td>
            <td>
              <Meter percent={((node.sdo_ms ?? 0) / most) * 100} alarm={101} label={t('node.sdo')} />
            </td>
            <td class="number">{ms(node.sdo_ms)}</td>
            <td class="number">{t('bus.aborts', { count: number(node.aborts) })}</td>
            <td>
              {node.silent_seconds !== null && (
                <span class="fault">{t('node.silent', { seconds: number(node.silent_seconds, 1) })}</span>
              )}
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  )
}

const ROW = 25 // px
/** @type {[keyof Rate, (rate: Rate) => ComponentChildren, string?][]} */
const COLUMNS = [
  ['id', (rate) => <code>{rate.id}</code>, ''],
  ['name', (rate) => rate.name, ''],
  ['node', (rate) => rate.node ?? NONE, 'number'],
  ['per_second', (rate) => number(rate.per_second, 1), 'number'],
  [
    'share_percent',
    (rate) => (
      <>
        <Meter percent={rate.share_percent} alarm={50} label={t('ids.share_percent')} /> {percent(rate.share_percent)}
      </>
    ),
    'number',
  ],
  ['jitter_ms', (rate) => ms(rate.jitter_ms), 'number'],
  ['frames', (rate) => number(rate.frames), 'number'],
]

/**
 * Hundreds of COB-IDs, updated ten times a second, so only the rows in sight are rendered.
 * @param {{ ids: wire.Rate[] }} props
 */
function Ids({ ids }) {
  const [sort, setSort] = useState({ by: 'share_percent', down: true })
  const sign = sort.down ? -1 : 1
  const compare = (a, b) =>
    sign * (typeof a === 'string' && typeof b === 'string' ? a.localeCompare(b) : (a ?? -1) - (b ?? -1))
  const sorted = [...ids].sort((a, b) => compare(a[sort.by], b[sort.by]))
  const row = (at, style) => (
    <div key={sorted[at].id} role="row" class="id-row" style={style} data-test={`id-${sorted[at].id}`}>
      {COLUMNS.map(([key, cell, kind]) => (
        <span key={key} role="cell" class={kind}>
          {cell(sorted[at])}
        </span>
      ))}
    </div>
  )
  return (
    <div
      class="ids"
      role="table"
      aria-label={t('bus.ids', { count: ids.length })}
      aria-rowcount={ids.length}
      data-test="ids"
    >
      <div role="row" class="id-row head">
        {COLUMNS.map(([key, , kind]) => (
          <span key={key} role="columnheader" class={kind} aria-sort={sortOf(sort, key)}>
            <Button
              class="link"
              run={() => setSort({ by: key, down: sort.by === key ? !sort.down : kind === 'number' })}
            >
              {t(`ids.${key}`)}
            </Button>
          </span>
        ))}
      </div>
      <Rows
        role="rowgroup"
        tabindex={0}
        aria-label={t('bus.ids', { count: ids.length })}
        count={sorted.length}
        height={ROW}
        row={row}
      />
    </div>
  )
}

function sortOf(sort, key) {
  if (sort.by !== key) return 'none'
  return sort.down ? 'descending' : 'ascending'
}
