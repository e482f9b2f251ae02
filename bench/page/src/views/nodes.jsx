// The nodes on the bus, the state of each, and its faults.
import { useState } from 'preact/hooks'
import { clock, hex, ms, NONE, number } from '../format.js'
import { t } from '../i18n/index.js'
import { chosenNode, goTo, node, nodeId, view } from '../state.js'
import {
  Act,
  Button,
  Empty,
  ControlHint,
  Field,
  RequestButton,
  Panel,
  Refusal,
  RowLink,
  State,
  roving,
  useAsk,
} from '../ui.jsx'

/**
 * @import { Fault, Nmt } from '../wire'
 * @import * as wire from '../wire'
 */

export function Nodes() {
  const nodes = view.nodes.value
  return (
    <div class="split">
      <Panel title={t('nodes.title', { count: nodes.length })} tools={<BusOrders />}>
        {nodes.length === 0 ? <Empty>{t('nodes.none')}</Empty> : <NodeTable nodes={nodes} />}
      </Panel>
      <div class="stack">
        {node.value && <NodeDetails node={node.value} />}
        <Lss />
      </div>
    </div>
  )
}

function BusOrders() {
  return (
    <>
      <RequestButton data-test="scan" request={{ do: 'scan' }}>
        {t('nodes.scan')}
      </RequestButton>
      <NmtButtons node={null} test="nmt-all" />
    </>
  )
}

/** @type {Nmt[]} */
const NMT = ['start', 'pre-operational', 'stop', 'reset-node', 'reset-communication']

/** @param {{ node: number | null, test: string }} props */
function NmtButtons({ node, test }) {
  return (
    <div class="choice" role="group" aria-label={node === null ? t('nmt.all') : t('nmt.node', { node })}>
      {NMT.map((command) => (
        <RequestButton
          key={command}
          data-test={`${test}-${command}`}
          title={t(`nmt.${command}.help`)}
          request={{ do: 'nmt', node, command }}
        >
          {t(`nmt.${command}`)}
        </RequestButton>
      ))}
    </div>
  )
}

/** @param {{ nodes: wire.Node[] }} props */
function NodeTable({ nodes }) {
  return (
    <div class="scroll">
      <table class="grid rows-clickable" data-test="nodes">
        <thead>
          <tr>
            <th class="number">{t('node.id')}</th>
            <th>{t('node.name')}</th>
            <th>{t('node.state')}</th>
            <th>{t('node.faults')}</th>
            <th class="number">{t('node.heartbeat')}</th>
            <th class="number">{t('node.sdo')}</th>
            <th>{t('node.sheet')}</th>
          </tr>
        </thead>
        <tbody onKeyDown={roving}>
          {nodes.map((each) => (
            <NodeRow key={each.id} node={each} />
          ))}
        </tbody>
      </table>
    </div>
  )
}

/** @param {{ node: wire.Node }} props */
function NodeRow({ node }) {
  const isChosen = node.id === nodeId.value
  const choose = () => (chosenNode.value = node.id)
  return (
    <tr
      data-test={`node-${node.id}`}
      data-roving
      tabindex={isChosen ? 0 : -1}
      aria-selected={isChosen}
      class={node.faults.length > 0 ? 'faulty' : ''}
      onClick={choose}
      onFocus={choose}
    >
      <td class="number">
        <b>{node.id}</b>
      </td>
      <td>{node.name}</td>
      <td>
        <State state={node.state} seen={node.seen} data-test={`node-${node.id}-state`} />
      </td>
      <td class="wrap">
        {node.faults.map((fault) => (
          <span key={fault.row} class="fault" data-test={`node-${node.id}-fault`}>
            <code>{fault.code}</code> {fault.text} <RowLink row={fault.row} />
          </span>
        ))}
        {node.silent_seconds !== null && (
          <span class="fault">{t('node.silent', { seconds: number(node.silent_seconds, 1) })}</span>
        )}
      </td>
      <td class="number">{ms(node.heartbeat_ms)}</td>
      <td class="number">{ms(node.sdo_ms)}</td>
      <td>
        <code>{node.sheet ?? NONE}</code>
      </td>
    </tr>
  )
}

/** @param {{ node: wire.Node }} props */
function NodeDetails({ node }) {
  return (
    <Panel
      title={`${node.id} · ${node.name}`}
      data-test="node-details"
      tools={<NmtButtons node={node.id} test={`node-${node.id}-nmt`} />}
    >
      <ControlHint />
      <dl class="facts">
        <Fact name={t('node.state')}>
          <State state={node.state} seen={node.seen} />
        </Fact>
        <Fact name={t('node.heartbeat')}>{ms(node.heartbeat_ms)}</Fact>
        <Fact name={t('node.vendor')}>{hex(node.identity[0])}</Fact>
        <Fact name={t('node.product')}>{hex(node.identity[1])}</Fact>
        <Fact name={t('node.revision')}>{hex(node.identity[2])}</Fact>
        <Fact name={t('node.serial')}>{hex(node.identity[3])}</Fact>
        <Fact name={t('node.boots')}>{number(node.boots)}</Fact>
        <Fact name={t('node.sdo')}>{ms(node.sdo_ms)}</Fact>
        <Fact name={t('node.aborts')}>{number(node.aborts)}</Fact>
      </dl>
      <SetSheet key={node.id} node={node} />
      <p class="links">
        <Button class="link" data-test="to-objects" run={() => goTo('objects', node.id)}>
          {t('tab.objects')}
        </Button>
        <Button class="link" run={() => goTo('pdos', node.id)}>
          {t('tab.pdos')}
        </Button>
        {view.drives.value.some((drive) => drive.node === node.id) && (
          <Button class="link" run={() => goTo('drives', node.id)}>
            {t('tab.drives')}
          </Button>
        )}
      </p>
      <h3>{t('node.faults')}</h3>
      <Faults faults={node.faults} none={t('node.no-faults')} test="faults" />
      {node.history.length > 0 && (
        <>
          <h3>{t('node.history')}</h3>
          <Faults faults={node.history} test="fault-history" />
        </>
      )}
      {node.lacks.length > 0 && (
        <>
          <h3>{t('node.lacks')}</h3>
          <ul class="plain" data-test="lacks">
            {node.lacks.map((lack) => (
              <li key={lack.text} class={lack.is_needed ? 'refusal' : ''}>
                {lack.text}
              </li>
            ))}
          </ul>
        </>
      )}
      <h3>{t('node.changes')}</h3>
      {node.changes.length === 0 ? (
        <Empty>{t('node.no-changes')}</Empty>
      ) : (
        <ul class="plain" data-test="changes">
          {node.changes.map((change) => (
            <li key={change}>{change}</li>
          ))}
        </ul>
      )}
    </Panel>
  )
}

export function Fact({ name, children }) {
  return (
    <div>
      <dt>{name}</dt>
      <dd>{children}</dd>
    </div>
  )
}

/** @param {{ faults: Fault[], none?: string, test: string }} props */
function Faults({ faults, none, test }) {
  if (faults.length === 0) return <Empty>{none}</Empty>
  return (
    <ul class="faults" data-test={test}>
      {faults.map((fault) => (
        <li key={fault.row}>
          <time>{clock(fault.at)}</time> <code>{fault.code}</code> <span>{fault.text}</span>{' '}
          <RowLink row={fault.row} test="fault-row" />
        </li>
      ))}
    </ul>
  )
}

/** @param {{ node: wire.Node }} props */
function SetSheet({ node }) {
  const [sheet, setSheet] = useState(node.sheet ?? '')
  const [asked, run] = useAsk()
  return (
    <form class="line" onSubmit={(event) => event.preventDefault()}>
      <Field
        class="grow"
        label={t('node.sheet')}
        data-test="sheet"
        value={sheet}
        placeholder="siko/ag03-1"
        spellcheck={false}
        set={setSheet}
      />
      <Button
        data-test="sheet-set"
        disabled={sheet === (node.sheet ?? '')}
        run={() => run({ do: 'set-sheet', node: node.id, sheet })}
      >
        {t('node.sheet.set')}
      </Button>
      {node.stores_sheet && (
        <Button data-test="sheet-fetch" run={() => run({ do: 'fetch-sheet', node: node.id })}>
          {t('node.sheet.fetch')}
        </Button>
      )}
      <Refusal of={asked.refused} test="sheet-refusal" />
    </form>
  )
}

/** Layer setting services (LSS): give a node-ID to a device without one. */
function Lss() {
  const [id, setId] = useState('')
  const [asked, run] = useAsk()
  const isTaken = view.nodes.value.some((each) => each.id === Number(id))
  const isValid = Number(id) >= 1 && Number(id) <= 127 && !isTaken
  return (
    <Panel title={t('lss.title')}>
      <p class="hint">{t('lss.help')}</p>
      <form class="line" onSubmit={(event) => event.preventDefault()}>
        <Field label={t('node.id')} data-test="lss-node" type="number" min="1" max="127" value={id} set={setId} />
        <Act data-test="lss-assign" disabled={!isValid} run={() => run({ do: 'assign', node: Number(id) })}>
          {t('lss.assign')}
        </Act>
        {isTaken && <p class="hint">{t('lss.taken', { id })}</p>}
        <Refusal of={asked.refused} />
      </form>
    </Panel>
  )
}
