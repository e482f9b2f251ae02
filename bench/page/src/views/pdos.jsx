// What the PDOs of a node carry, as pictures of their bits.
import { useEffect, useRef, useState } from 'preact/hooks'
import { FRAME_BITS, usedBits } from '../bits.js'
import { ask, send } from '../bench.js'
import { number } from '../format.js'
import { t } from '../i18n/index.js'
import { connection, goTo, nodeId, view } from '../state.js'
import { Age, Button, Empty, NodePicker, Panel, Refusal, useAsk } from '../ui.jsx'
import { Bits, where } from './bits.jsx'
import { MapEditor } from './map-editor.jsx'

/** @import * as wire from '../wire' */

const EVERY = 1000 // ms between two requests for the known values

/** The PDOs of a node: read from it when it is chosen, and when `read` is called. */
function usePdos(node) {
  const [pdos, setPdos] = useState(null)
  const [asked, run] = useAsk()
  const latest = useRef(null)
  latest.current = node
  const read = async () => {
    const found = await run({ do: 'pdos', node })
    if (found && latest.current === node) setPdos(found)
  }
  useEffect(() => {
    setPdos(null)
    if (node !== null && connection.value === 'open') read()
  }, [node, connection.value])
  return { pdos, asked, read }
}

/** The entries of the data sheet by address, with the values known so far: this reads nothing from the node. */
function useEntries(node) {
  const [entries, setEntries] = useState(new Map())
  useEffect(() => {
    if (node === null || connection.value !== 'open') return
    let isCurrent = true
    let timer
    const look = async () => {
      const found = await ask({ do: 'objects', node }).catch(() => /** @type {wire.Object[]} */ ([]))
      if (!isCurrent) return
      setEntries(new Map(found.map((entry) => [entry.address, entry])))
      timer = setTimeout(look, EVERY)
    }
    look()
    return () => {
      isCurrent = false
      clearTimeout(timer)
    }
  }, [node, connection.value])
  return entries
}

const KINDS = { RPDO: 'pdos.receive', TPDO: 'pdos.transmit' }

export function Pdos() {
  const node = nodeId.value
  const { pdos, asked, read } = usePdos(node)
  const entries = useEntries(node)
  const [edited, setEdited] = useState(null)
  useEffect(() => setEdited(null), [node])
  const close = () => {
    setEdited(null)
    read()
  }
  return (
    <Panel
      class="fill"
      title={t('pdos.title')}
      tools={
        <>
          <NodePicker />
          <Button data-test="pdos-read" aria-disabled={asked.busy} run={read}>
            {t('pdos.read')}
          </Button>
        </>
      }
    >
      <Refusal of={asked.refused} test="pdos-refusal" />
      {!pdos && asked.busy && <Empty>{t('loading')}</Empty>}
      {pdos?.length === 0 && <Empty>{t('pdos.none')}</Empty>}
      <div class="scroll pdos">
        {pdos &&
          Object.entries(KINDS).map(([kind, title]) => (
            <section key={kind} aria-label={t(title)}>
              <h3>{t(title)}</h3>
              {pdos
                .filter((pdo) => pdo.name.startsWith(kind))
                .map((pdo) => (
                  <Pdo
                    key={pdo.name}
                    node={node}
                    pdo={pdo}
                    entries={entries}
                    isEdited={edited === pdo.name}
                    edit={() => setEdited(pdo.name)}
                    close={close}
                  />
                ))}
            </section>
          ))}
      </div>
    </Panel>
  )
}

/** @param {{ node: number, pdo: wire.Pdo, entries: Map<string, wire.Object>, isEdited: boolean, edit: () => void, close: () => void }} props */
function Pdo({ node, pdo, entries, isEdited, edit, close }) {
  const rate = view.bus.value.ids.find((each) => each.id === pdo.id)?.per_second ?? 0
  return (
    <article class={`pdo ${pdo.is_on ? '' : 'off'}`} data-test={`pdo-${pdo.name}`} aria-label={pdo.name}>
      <header>
        <h4>{pdo.name}</h4>
        <code>{pdo.id}</code>
        <span class={`state ${pdo.is_on ? 'good' : 'none'}`}>{t(pdo.is_on ? 'pdo.on' : 'pdo.off')}</span>
        <span>{pdo.transmission}</span>
        {pdo.event_timer_ms > 0 && <span>{t('pdo.timer', { ms: number(pdo.event_timer_ms) })}</span>}
        {pdo.inhibit_ms > 0 && <span>{t('pdo.inhibit', { ms: number(pdo.inhibit_ms, 1) })}</span>}
        <span class="figure">{t('per-second', { count: number(rate, 1) })}</span>
        <span class="figure">{t('pdo.bits', { used: usedBits(pdo.fields), all: FRAME_BITS })}</span>
        <div class="tools">
          <Button
            data-test={`pdo-${pdo.name}-plot`}
            disabled={pdo.fields.length === 0}
            run={() =>
              send({ do: 'plot', node, signals: [pdo.name.toLowerCase()], every_ms: 100 }).then(() => goTo('plots'))
            }
          >
            {t('entry.plot')}
          </Button>
          <Button data-test={`pdo-${pdo.name}-edit`} aria-expanded={isEdited} run={isEdited ? close : edit}>
            {t(isEdited ? 'close' : 'pdo.edit')}
          </Button>
        </div>
      </header>
      {pdo.conflict && (
        <p class="conflict" role="alert">
          {pdo.conflict}
        </p>
      )}
      {isEdited ? <MapEditor node={node} pdo={pdo} entries={entries} close={close} /> : <Bits fields={pdo.fields} />}
      {!isEdited && pdo.fields.length > 0 && (
        <ul class="legend">
          {pdo.fields.map((field, place) => (
            <li key={field.first_bit} class={`tint-${place % 8}`}>
              <code>{field.address}</code> {field.name} <small>{where(field)}</small>{' '}
              <b class="value">{entries.get(field.address)?.value?.text ?? field.text ?? ''}</b>{' '}
              {/* If the PDO has stopped coming, this is its last value. */}
              {field.at !== null && <Age seen={{ at: field.at, is_old: rate === 0 }} />}
            </li>
          ))}
        </ul>
      )}
    </article>
  )
}
