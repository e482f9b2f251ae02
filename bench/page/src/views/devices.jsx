// Controls of simulated devices: power, inputs, faults.
import { useState } from 'preact/hooks'
import { send } from '../bench.js'
import { t } from '../i18n/index.js'
import { view } from '../state.js'
import { Act, Empty, ControlHint, RequestButton, Panel } from '../ui.jsx'

/** @import * as wire from '../wire' */

export function Devices() {
  const devices = view.devices.value
  if (devices.length === 0)
    return (
      <Panel title={t('tab.devices')}>
        <Empty>{t('devices.none')}</Empty>
      </Panel>
    )
  return (
    <div class="cards">
      {devices.map((device) => (
        <Device key={device.node} device={device} />
      ))}
    </div>
  )
}

/** @param {{ device: wire.Simulated }} props */
function Device({ device }) {
  const { node } = device
  return (
    <Panel
      title={`${node} · ${device.name}`}
      data-test={`device-${node}`}
      tools={
        <>
          <span class={`state ${device.is_on ? 'good' : 'none'}`}>{t(device.is_on ? 'device.on' : 'device.off')}</span>
          <RequestButton data-test={`device-${node}-power`} request={{ do: 'power', node, on: !device.is_on }}>
            {t(device.is_on ? 'device.cut' : 'device.supply')}
          </RequestButton>
        </>
      }
    >
      <ControlHint />
      {device.inputs.length === 0 && <Empty>{t('device.no-inputs')}</Empty>}
      <ul class="inputs">
        {device.inputs.map((input) => (
          <Input key={input.name} node={node} input={input} />
        ))}
      </ul>
    </Panel>
  )
}

/** With more choices than this, they take several lines. */
const MANY = 3

/** @param {{ node: number, input: wire.Input }} props */
function Input({ node, input }) {
  const test = `device-${node}-${input.name}`
  const set = (value) => send({ do: 'input', node, text: `${input.name} = ${value}` })
  return (
    <li data-test={test}>
      <div>
        <b>{input.name}</b> <small>{input.help}</small>
      </div>
      {input.choices.length > 0 ? (
        <div class={input.choices.length > MANY ? 'chips' : 'choice'} role="group" aria-label={input.name}>
          {input.choices.map((choice) => (
            <Act
              key={choice}
              data-test={`${test}-${choice}`}
              aria-pressed={input.value === choice}
              run={() => set(choice)}
            >
              {choice}
            </Act>
          ))}
        </div>
      ) : (
        <NumberInput test={test} value={input.value} set={set} />
      )}
    </li>
  )
}

function NumberInput({ test, value, set }) {
  const [text, setText] = useState('')
  return (
    <div class="line">
      <span class="value">{value ?? '–'}</span>
      <input
        data-test={`${test}-value`}
        aria-label={t('entry.new')}
        size={8}
        value={text}
        onInput={(event) => setText(event.currentTarget.value)}
      />
      <Act data-test={`${test}-set`} disabled={text.trim() === ''} run={() => set(text)}>
        {t('device.set')}
      </Act>
    </div>
  )
}
