// A panel for each drive: its state machine, orders, position and velocity, and why it would refuse.
import { useState } from 'preact/hooks'
import { order } from '../bench.js'
import { exact, number } from '../format.js'
import { t } from '../i18n/index.js'
import { goTo, view, whyNot } from '../state.js'
import { Act, Age, Button, Empty, HandsHint, isOld, Panel, Refusal, useAsk } from '../ui.jsx'
import { Machine, kindOf } from './machine.jsx'

export function Drives() {
  const drives = view.drives.value
  if (drives.length === 0)
    return (
      <Panel title={t('tab.drives')}>
        <Empty>{t('drives.none')}</Empty>
      </Panel>
    )
  return (
    <div class="drives">
      {drives.map((drive) => (
        <Drive key={drive.node} drive={drive} />
      ))}
    </div>
  )
}

function Drive({ drive }) {
  const { node } = drive
  const test = `drive-${node}`
  const [{ refused }, run] = useAsk()
  const send = (name, value = null) => run({ do: 'drive', node, order: name, value })
  const plot = () =>
    order({ do: 'plot', node, signals: ['6064:00', '606C:00'], every_ms: 50 }).then(() => goTo('plots', node))
  return (
    <Panel
      title={`${node} · ${drive.name}`}
      data-test={test}
      class="drive"
      tools={
        <>
          <Age seen={drive.seen} test={`${test}-seen`} />
          <span class={`state ${isOld(drive.seen) ? 'old' : kindOf(drive.state)}`} data-test={`${test}-state`}>
            {drive.state ?? t('unknown')}
          </span>
          <Button data-test={`${test}-plot`} run={plot}>
            {t('entry.plot')}
          </Button>
        </>
      }
    >
      <Unconfirmed drive={drive} />
      <div class="drive-body">
        <Machine drive={drive} send={send} />
        <div class="stack">
          <Motion drive={drive} />
          {/* Nobody looks while nobody has the hands. */}
          {drive.obstacles && <Obstacles obstacles={drive.obstacles} test={`${test}-obstacles`} />}
          <Orders drive={drive} send={send} />
          {refused?.why !== drive.ending?.text && <Refusal of={refused} test={`${test}-refusal`} />}
          <HandsHint />
          <Ending drive={drive} />
        </div>
      </div>
    </Panel>
  )
}

/** A stop that is sent until the drive has confirmed it. */
function Unconfirmed({ drive: { node, unconfirmed } }) {
  if (!unconfirmed) return null
  return (
    <p class="conflict" role="alert" data-test={`drive-${node}-unconfirmed`}>
      <strong>{t('drive.unconfirmed', { seconds: number(view.time.value - unconfirmed.since, 1) })}</strong>{' '}
      {unconfirmed.why}
    </p>
  )
}

function Motion({ drive }) {
  const { node } = drive
  const unit = (unit) => unit ?? t('plots.increments')
  return (
    <dl class={isOld(drive.seen) ? 'motion old' : 'motion'}>
      <div>
        <dt>{t('drive.position')}</dt>
        <dd data-test={`drive-${node}-position`}>
          {exact(drive.position)} <small>{unit(drive.position_unit)}</small>
        </dd>
      </div>
      <div>
        <dt>{t('drive.velocity')}</dt>
        <dd data-test={`drive-${node}-velocity`}>
          {exact(drive.velocity)} <small>{drive.velocity_unit}</small>
        </dd>
      </div>
      <div>
        <dt>{t('drive.target')}</dt>
        <dd data-test={`drive-${node}-target`}>
          {exact(drive.target)} {drive.target !== null && <small>{unit(drive.position_unit)}</small>}
        </dd>
      </div>
      <div>
        <dt>{t('drive.mode')}</dt>
        <dd data-test={`drive-${node}-mode`}>{drive.mode ?? '–'}</dd>
      </div>
    </dl>
  )
}

function Obstacles({ obstacles, test }) {
  if (obstacles.length === 0)
    return (
      <p class="done" data-test={test}>
        {t('drive.ready')}
      </p>
    )
  return (
    <div class="obstacles" data-test={test}>
      <h3>{t('drive.obstacles')}</h3>
      <ul>
        {obstacles.map((obstacle) => (
          <li key={obstacle}>{obstacle}</li>
        ))}
      </ul>
    </div>
  )
}

const POWER = ['enable', 'disable', 'reset-fault']
const MOVES = ['move-to', 'step', 'run']
/** What to do with a travel that a stop has interrupted. */
const AFTER = ['resume', 'drop']
const STOPS = ['stop', 'quick-stop']

function Orders({ drive, send }) {
  const { node, orders } = drive
  const [value, setValue] = useState('')
  const [method, setMethod] = useState(null)
  const button = (name, value, disabled) =>
    orders.includes(name) && (
      <Act
        key={name}
        data-test={`drive-${node}-${name}`}
        disabled={disabled}
        title={t(`order.${name}.help`)}
        run={() => send(name, value)}
      >
        {t(`order.${name}`)}
      </Act>
    )
  // A stop needs no hands.
  const stopping = (name) =>
    orders.includes(name) && (
      <Button
        key={name}
        class="stopping"
        data-test={`drive-${node}-${name}`}
        title={t(`order.${name}.help`)}
        run={() => send(name)}
      >
        {t(`order.${name}`)}
      </Button>
    )
  const homing = method ?? drive.homing_methods[0]
  return (
    <div class="orders">
      <div class="line">{POWER.map((name) => button(name))}</div>
      <div class="line">
        <label class="field grow">
          <span>{t('drive.value')}</span>
          <input
            data-test={`drive-${node}-value`}
            value={value}
            placeholder={`90 ${drive.position_unit ?? ''}`}
            autocomplete="off"
            onInput={(event) => setValue(event.target.value)}
            onKeyDown={(event) =>
              event.key === 'Enter' && whyNot.value === null && value.trim() && send('move-to', value)
            }
          />
        </label>
        {MOVES.map((name) => button(name, value, value.trim() === ''))}
      </div>
      {orders.includes('home') && (
        <div class="line">
          {drive.homing_methods.length > 0 && (
            <label class="field">
              <span>{t('drive.method')}</span>
              <select
                data-test={`drive-${node}-method`}
                value={homing}
                onChange={(event) => setMethod(Number(event.target.value))}
              >
                {drive.homing_methods.map((each) => (
                  <option key={each} value={each}>
                    {each}
                  </option>
                ))}
              </select>
            </label>
          )}
          {button('home', homing === undefined ? null : String(homing))}
        </div>
      )}
      <div class="line">
        {STOPS.map(stopping)}
        {AFTER.map((name) => button(name))}
      </div>
    </div>
  )
}

function Ending({ drive }) {
  const { order: present, ending, node } = drive
  return (
    <div class="ending" role="status" data-test={`drive-${node}-ending`}>
      {present && <p class="working">{present}</p>}
      {ending && (
        <div class={!ending.is_success ? 'refusal' : isOld(drive.seen) ? 'hint' : 'done'}>
          <strong>{ending.text}</strong>
          {ending.remedy && <span> {ending.remedy}</span>}
          {ending.may_be_moving && (
            <p class="conflict" role="alert">
              {t('drive.may-be-moving')}
            </p>
          )}
        </div>
      )}
    </div>
  )
}
