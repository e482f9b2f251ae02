// A panel for each drive: its state machine, orders, position and velocity, and why it would refuse.
import { useState } from 'preact/hooks'
import { send } from '../bench.js'
import { exact, number } from '../format.js'
import { language, t } from '../i18n/index.js'
import { goTo, view, whyNot } from '../state.js'
import { Act, Age, Button, Choice, Empty, ControlHint, Field, isOld, Panel, Refusal, useAsk } from '../ui.jsx'
import { ORDERS } from '../words.js'
import { Machine, kindOf } from './machine.jsx'
import { Sequences } from './sequences.jsx'

/**
 * @import { Verb } from '../wire'
 * @import * as wire from '../wire'
 */

/**
 * Gives an order to a drive.
 * @typedef {(name: Verb, value?: string | null) => unknown} Give
 */

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
      <Sequences />
    </div>
  )
}

/** @param {{ drive: wire.Drive }} props */
function Drive({ drive }) {
  const { node } = drive
  const test = `drive-${node}`
  const [{ refused }, run] = useAsk()
  /** @type {Give} */
  const give = (name, value = null) => run({ do: 'drive', node, order: name, value })
  const plot = () =>
    send({ do: 'plot', node, signals: ['6064:00', '606C:00'], every_ms: 50 }).then(() => goTo('plots', node))
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
        <Machine drive={drive} give={give} />
        <div class="stack">
          <Motion drive={drive} />
          {/* The bench checks for obstacles only while somebody has control. */}
          {drive.obstacles && <Obstacles obstacles={drive.obstacles} test={`${test}-obstacles`} />}
          <Orders drive={drive} give={give} />
          {refused?.why !== drive.ending?.text && <Refusal of={refused} test={`${test}-refusal`} />}
          <ControlHint />
          <Ending drive={drive} />
        </div>
      </div>
    </Panel>
  )
}

/**
 * A stop that is repeated until the drive has confirmed it.
 * @param {{ drive: wire.Drive }} props
 */
function Unconfirmed({ drive: { node, unconfirmed } }) {
  if (!unconfirmed) return null
  return (
    <p class="conflict" role="alert" data-test={`drive-${node}-unconfirmed`}>
      <strong>{t('drive.unconfirmed', { seconds: number(view.time.value - unconfirmed.since, 1) })}</strong>{' '}
      {unconfirmed.why}
    </p>
  )
}

/** @param {{ drive: wire.Drive }} props */
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

/** @param {{ drive: wire.Drive, give: Give }} props */
function Orders({ drive, give }) {
  const { node, orders } = drive
  const [value, setValue] = useState('')
  const [method, setMethod] = useState(null)
  const known = (group) => ORDERS.filter((order) => order.group === group && orders.includes(order.verb))
  const texts = ({ verb, titles, help }) => {
    const at = language.value === 'de' ? 1 : 0
    return { 'data-test': `drive-${node}-${verb}`, title: help[at], children: titles[at] }
  }
  const button = (order, value = null, disabled = false) => (
    <Act key={order.verb} {...texts(order)} disabled={disabled} run={() => give(order.verb, value)} />
  )
  const homing = method ?? drive.homing_methods[0]
  return (
    <div class="orders">
      <div class="line">{known('power').map((order) => button(order))}</div>
      <div class="line">
        <Field
          class="grow"
          label={t('drive.value')}
          data-test={`drive-${node}-value`}
          value={value}
          placeholder={`90 ${drive.position_unit ?? ''}`}
          autocomplete="off"
          set={setValue}
          onKeyDown={(event) =>
            event.key === 'Enter' && whyNot.value === null && value.trim() && give('move-to', value)
          }
        />
        {known('move').map((order) => button(order, value, value.trim() === ''))}
      </div>
      {orders.includes('home') && (
        <div class="line">
          {drive.homing_methods.length > 0 && (
            <Choice
              label={t('drive.method')}
              data-test={`drive-${node}-method`}
              value={homing}
              options={drive.homing_methods.map((each) => [each, each])}
              set={(method) => setMethod(Number(method))}
            />
          )}
          {known('home').map((order) => button(order, homing === undefined ? null : String(homing)))}
        </div>
      )}
      <div class="line">
        {/* A stop needs no control. */}
        {known('stop').map((order) => (
          <Button key={order.verb} {...texts(order)} class="stopping" run={() => give(order.verb)} />
        ))}
        {known('after').map((order) => button(order))}
      </div>
    </div>
  )
}

/** @param {{ drive: wire.Drive }} props */
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
