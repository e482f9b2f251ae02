// An editor for the mapping of a PDO, by drag or by keys. The bench checks the mapping before anything is written.
import { useEffect, useRef, useState } from 'preact/hooks'
import { FRAME_BITS, insert, move, place, placeOfBit, remove, usedBits } from '../bits.js'
import { ask } from '../bench.js'
import { t } from '../i18n/index.js'
import { Act, Button, ControlHint, Field, Refusal, useAsk } from '../ui.jsx'
import { Bits, where } from './bits.jsx'

/** @import * as wire from '../wire' */

const PATIENCE = 300 // ms from the last change to its check
const TRANSMISSIONS = ['event', 'sync', 'sync:2', 'sync:4', 'every:10ms', 'every:100ms']

/** The bit of the picture under the pointer. */
function bitOf(event) {
  const { left, width } = event.currentTarget.getBoundingClientRect()
  return ((event.clientX - left) / width) * FRAME_BITS
}

/**
 * What the bench objects to in a mapping; null until it answers.
 * @param {Extract<wire.Request, { do: 'map-pdo' }>} request
 */
function useObjections(request) {
  const [objections, setObjections] = useState(null)
  const key = JSON.stringify(request)
  useEffect(() => {
    let isCurrent = true
    setObjections(null)
    const timer = setTimeout(() => {
      ask({ ...request, check: true }).then(
        (found) => isCurrent && setObjections(found),
        (refused) => isCurrent && setObjections([refused.why]),
      )
    }, PATIENCE)
    return () => {
      isCurrent = false
      clearTimeout(timer)
    }
  }, [key])
  return objections
}

/** @param {{ node: number, pdo: wire.Pdo, entries: Map<string, wire.Object>, close: () => void }} props */
export function MapEditor({ node, pdo, entries, close }) {
  const [fields, setFields] = useState(pdo.fields)
  const [transmission, setTransmission] = useState('')
  const [asked, run] = useAsk()
  /** How many bits an entry has, by the data sheet. */
  const sizeOf = (address) => entries.get(address)?.bits
  const list = useRef(null)
  const [over, setOver] = useState(null)
  /** @type {Extract<wire.Request, { do: 'map-pdo' }>} */
  const request = {
    do: 'map-pdo',
    node,
    pdo: pdo.name.toLowerCase(),
    objects: fields.map((field) => field.address),
    transmission: transmission || null,
    check: false,
  }
  const objections = useObjections(request)
  const isChanged =
    transmission !== '' ||
    fields.map((field) => field.address).join() !== pdo.fields.map((field) => field.address).join()

  const add = (address, at = fields.length) => {
    const found = pdo.mappable.find(([each]) => each === address)
    if (found)
      setFields((fields) => insert(fields, at, { address, name: found[1], bits: sizeOf(address) ?? 8, text: null }))
  }
  /** Inserts what was dragged: a mappable entry, or a field of the mapping. */
  const drop = (event, at) => {
    event.preventDefault()
    event.stopPropagation()
    setOver(null)
    const dragged = event.dataTransfer.getData('text/plain')
    if (dragged.startsWith('field '))
      setFields((fields) => move(fields, Number(dragged.slice(6)), Math.min(at, fields.length - 1)))
    else add(dragged, at)
  }
  const keys = (event, at) => {
    const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key]
    const focus = (place) => setTimeout(() => list.current.querySelectorAll('.mapped')[place]?.focus())
    if (step && event.altKey) {
      setFields((fields) => move(fields, at, at + step))
      focus(Math.max(0, Math.min(fields.length - 1, at + step)))
    } else if (step) focus(at + step)
    else if (event.key === 'Delete' || event.key === 'Backspace') {
      setFields((fields) => remove(fields, at))
      focus(Math.max(0, at - 1))
    } else return
    event.preventDefault()
  }
  const apply = async () => {
    if (await run(request)) close()
  }
  const used = usedBits(fields)
  return (
    <div class="map-editor" data-test="map-editor">
      <Mappable pdo={pdo} sizeOf={sizeOf} add={add} />
      <div class="stack" onDragOver={(event) => event.preventDefault()} onDrop={(event) => drop(event, fields.length)}>
        <Bits
          fields={place(fields)}
          data-test="pdo-picture"
          onDrop={(event) => drop(event, placeOfBit(place(fields), bitOf(event)))}
        />
        <ol class="mapping" ref={list} aria-label={t('map.present')} data-test="pdo-mapping">
          {place(fields).map((field, at) => (
            <li
              key={`${at} ${field.address}`}
              class={`mapped tint-${at % 8} ${over === at ? 'over' : ''}`}
              tabindex={0}
              draggable
              data-test={`mapped-${field.address}`}
              aria-keyshortcuts="Alt+ArrowLeft Alt+ArrowRight Delete"
              onKeyDown={(event) => keys(event, at)}
              onDragStart={(event) => event.dataTransfer.setData('text/plain', `field ${at}`)}
              onDragEnter={() => setOver(at)}
              onDragEnd={() => setOver(null)}
              onDragOver={(event) => event.preventDefault()}
              onDrop={(event) => drop(event, at)}
            >
              <code>{field.address}</code> {field.name} <small>{where(field)}</small>
              <Button
                class="quiet"
                aria-label={t('map.earlier')}
                title={t('map.earlier')}
                disabled={at === 0}
                run={() => setFields(move(fields, at, at - 1))}
              >
                ↑
              </Button>
              <Button
                class="quiet"
                aria-label={t('map.later')}
                title={t('map.later')}
                disabled={at === fields.length - 1}
                run={() => setFields(move(fields, at, at + 1))}
              >
                ↓
              </Button>
              <Button
                class="quiet"
                aria-label={t('map.remove')}
                title={t('map.remove')}
                run={() => setFields(remove(fields, at))}
              >
                ×
              </Button>
            </li>
          ))}
          {fields.length === 0 && <li class="empty">{t('map.empty')}</li>}
        </ol>
        <p class={used > FRAME_BITS ? 'error' : 'hint'}>
          {t('pdo.bits', { used, all: FRAME_BITS })} · {t('map.help')}
        </p>
        <ul class="objections" aria-live="polite" data-test="pdo-objections">
          {objections === null && <li class="hint">{t('map.checking')}</li>}
          {objections?.map((objection) => (
            <li key={objection} class="conflict">
              {objection}
            </li>
          ))}
          {objections?.length === 0 && <li class="done">{t('map.fine')}</li>}
        </ul>
        <div class="line">
          <Field
            label={t('map.transmission')}
            list="transmissions"
            data-test="pdo-transmission"
            value={transmission}
            placeholder={pdo.transmission}
            set={setTransmission}
          >
            <datalist id="transmissions">
              {TRANSMISSIONS.map((each) => (
                <option key={each} value={each} />
              ))}
            </datalist>
          </Field>
          <Act
            class="main"
            data-test="pdo-apply"
            disabled={!isChanged || objections?.length !== 0 || asked.busy}
            run={apply}
          >
            {t('map.apply')}
          </Act>
          <Button
            data-test="pdo-revert"
            disabled={!isChanged}
            run={() => {
              setFields(pdo.fields)
              setTransmission('')
            }}
          >
            {t('map.revert')}
          </Button>
          <ControlHint />
        </div>
        <Refusal of={asked.refused} test="pdo-refusal" />
      </div>
    </div>
  )
}

/** @param {{ pdo: wire.Pdo, sizeOf: (address: string) => number | null, add: (address: string) => void }} props */
function Mappable({ pdo, sizeOf, add }) {
  const [query, setQuery] = useState('')
  const wanted = query.toLowerCase()
  const found = pdo.mappable.filter(([address, name]) => `${address} ${name}`.toLowerCase().includes(wanted))
  const [chosen, setChosen] = useState(null)
  const address = found.some(([each]) => each === chosen) ? chosen : found[0]?.[0]
  return (
    <div class="mappable">
      <Field
        label={t('map.mappable')}
        type="search"
        data-test="pdo-search"
        value={query}
        set={setQuery}
        onKeyDown={(event) => event.key === 'Enter' && address && add(address)}
      />
      <ul
        role="listbox"
        aria-label={t('map.mappable')}
        tabindex={0}
        onKeyDown={(event) => {
          const at = found.findIndex(([each]) => each === address)
          const next = { ArrowDown: found[at + 1], ArrowUp: found[at - 1] }[event.key]
          if (next) setChosen(next[0])
          else if (event.key === 'Enter' && address) add(address)
          else return
          event.preventDefault()
        }}
      >
        {found.map(([each, name]) => (
          <li
            key={each}
            role="option"
            data-test={`mappable-${each}`}
            aria-selected={each === address}
            draggable
            onDragStart={(event) => event.dataTransfer.setData('text/plain', each)}
            onClick={() => setChosen(each)}
            onDblClick={() => add(each)}
          >
            <code>{each}</code> {name} <small>{sizeOf(each) && t('bits.count', { bits: sizeOf(each) })}</small>
          </li>
        ))}
      </ul>
      <Button data-test="pdo-add" disabled={!address} run={() => add(address)}>
        {t('map.add')}
      </Button>
    </div>
  )
}
