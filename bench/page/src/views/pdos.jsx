// What the PDOs of a node carry, as pictures of their bits.
import { useEffect, useState } from 'preact/hooks'
import { FRAME_BITS, usedBits } from '../bits.js'
import { ask, order } from '../bench.js'
import { number } from '../format.js'
import { t } from '../i18n/index.js'
import { connection, goTo, nodeId } from '../state.js'
import { Button, Empty, NodePicker, Panel, Refusal } from '../ui.jsx'
import { Bits, where } from './bits.jsx'
import { MapEditor } from './map-editor.jsx'

const EVERY = 1000 // ms from look to look

/** The PDOs of a node, looked at again and again for their live values. */
function usePdos(node) {
  const [pdos, setPdos] = useState(null)
  const [refused, setRefused] = useState(null)
  useEffect(() => {
    let timer
    let isCurrent = true
    const look = async () => {
      try {
        const found = await ask({ do: 'pdos', node })
        if (!isCurrent) return
        setPdos(found)
        setRefused(null)
      } catch (why) {
        if (isCurrent) setRefused(why)
      }
      if (isCurrent) timer = setTimeout(look, EVERY)
    }
    setPdos(null)
    setRefused(null)
    if (node !== null && connection.value === 'open') look()
    return () => {
      isCurrent = false
      clearTimeout(timer)
    }
  }, [node, connection.value])
  return { pdos, refused }
}

export function Pdos() {
  const node = nodeId.value
  const { pdos, refused } = usePdos(node)
  const [edited, setEdited] = useState(null)
  useEffect(() => setEdited(null), [node])
  const groups = [['RPDO', 'pdos.receive'], ['TPDO', 'pdos.transmit']]
  return (
    <Panel class="fill" title={t('pdos.title')} tools={<NodePicker />}>
      <Refusal of={refused} />
      {!pdos && !refused && <Empty>{t('loading')}</Empty>}
      {pdos?.length === 0 && <Empty>{t('pdos.none')}</Empty>}
      <div class="scroll pdos">
        {pdos && groups.map(([kind, title]) => {
          const these = pdos.filter((pdo) => pdo.name.startsWith(kind))
          return these.length > 0 && (
            <section key={kind} aria-label={t(title)}>
              <h3>{t(title)}</h3>
              {these.map((pdo) => <Pdo key={pdo.name} node={node} pdo={pdo} isEdited={edited === pdo.name} edit={setEdited} />)}
            </section>
          )
        })}
      </div>
    </Panel>
  )
}

function Pdo({ node, pdo, isEdited, edit }) {
  return (
    <article class={`pdo ${pdo.is_on ? '' : 'off'}`} data-test={`pdo-${pdo.name}`} aria-label={pdo.name}>
      <header>
        <h4>{pdo.name}</h4>
        <code>{pdo.id}</code>
        <span class={`state ${pdo.is_on ? 'good' : 'none'}`}>{t(pdo.is_on ? 'pdo.on' : 'pdo.off')}</span>
        <span>{pdo.transmission}</span>
        {pdo.event_timer_ms !== null && <span>{t('pdo.timer', { ms: number(pdo.event_timer_ms) })}</span>}
        {pdo.inhibit_ms !== null && <span>{t('pdo.inhibit', { ms: number(pdo.inhibit_ms, 1) })}</span>}
        <span class="figure">{t('per-second', { count: number(pdo.per_second, 1) })}</span>
        <span class="figure">{t('pdo.bits', { used: usedBits(pdo.fields), all: FRAME_BITS })}</span>
        <div class="tools">
          <Button data-test={`pdo-${pdo.name}-plot`} disabled={pdo.fields.length === 0} run={() => order({ do: 'plot', node, signals: [pdo.name.toLowerCase()], every_ms: 100 }).then(() => goTo('plots'))}>{t('entry.plot')}</Button>
          <Button data-test={`pdo-${pdo.name}-edit`} aria-expanded={isEdited} run={() => edit(isEdited ? null : pdo.name)}>{t(isEdited ? 'close' : 'pdo.edit')}</Button>
        </div>
      </header>
      {pdo.conflict && <p class="conflict" role="alert">{pdo.conflict}</p>}
      {isEdited ? <MapEditor node={node} pdo={pdo} close={() => edit(null)} /> : <Bits fields={pdo.fields} />}
      {!isEdited && pdo.fields.length > 0 && (
        <ul class="legend">
          {pdo.fields.map((field, place) => (
            <li key={field.first_bit} class={`tint-${place % 8}`}>
              <code>{field.address}</code> {field.name} <small>{where(field)}</small> <b class="value">{field.text ?? ''}</b>
            </li>
          ))}
        </ul>
      )}
    </article>
  )
}
