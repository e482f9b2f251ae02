// One entry of a dictionary: its description, its value, and a field for another value.
import { useEffect, useState } from 'preact/hooks'
import { send } from '../bench.js'
import { t } from '../i18n/index.js'
import { goTo, view } from '../state.js'
import { Act, Button, ControlHint, Field, Panel, Refusal, useAsk } from '../ui.jsx'
import { Fact } from './nodes.jsx'

/** @import * as wire from '../wire' */

const EVERY = 250 // ms

/** @param {{ node: number, entry: wire.Object, entries: wire.Object[], take: (values: wire.Value[]) => void }} props */
export function Entry({ node, entry, entries, take }) {
  const { address } = entry
  const index = address.slice(0, 4)
  const members = entries.filter((each) => each.address.startsWith(index))
  const [reading, read] = useAsk()
  const readIt = async (addresses) => {
    const values = await read({ do: 'read', node, addresses })
    if (values) take(values)
  }
  useEffect(() => {
    if (entry.access !== 'wo' && view.bus.value.is_writable) readIt([address])
  }, [])
  const isWatched = view.watched.value.some((each) => each.node === node && each.address === address)
  return (
    <Panel
      title={`${address}  ${entry.name}`}
      data-test="entry"
      tools={
        <>
          <Button data-test="object-read" disabled={entry.access === 'wo'} run={() => readIt([address])}>
            {t('entry.read')}
          </Button>
          {members.length > 1 && (
            <Button data-test="record-read" title={t('entry.record.help')} run={() => readIt([index])}>
              {t('entry.record')}
            </Button>
          )}
          <Button
            data-test="watch"
            aria-pressed={isWatched}
            run={() =>
              send(isWatched ? { do: 'unwatch', node, address } : { do: 'watch', node, address, every_ms: EVERY })
            }
          >
            {t(isWatched ? 'entry.unwatch' : 'entry.watch')}
          </Button>
          <Button
            data-test="plot-object"
            run={() => send({ do: 'plot', node, signals: [address], every_ms: 100 }).then(() => goTo('plots'))}
          >
            {t('entry.plot')}
          </Button>
        </>
      }
    >
      <p class={`big ${entry.value?.is_error ? 'error' : ''}`} data-test="object-present">
        {entry.value?.text ?? t('entry.unread')}
      </p>
      <Refusal of={reading.refused} />
      {entry.access.includes('w') && <Write node={node} entry={entry} after={() => readIt([address])} />}
      <dl class="facts">
        <Fact name={t('entry.type')}>
          <code>{entry.data_type}</code>
        </Fact>
        <Fact name={t('entry.access')}>
          <code>{entry.access}</code>
          {entry.mappable && ` · ${t(`mappable.${entry.mappable}`)}`}
        </Fact>
        {entry.default !== null && <Fact name={t('entry.default')}>{entry.default}</Fact>}
        {(entry.low !== null || entry.high !== null) && (
          <Fact name={t('entry.limits')}>
            {entry.low ?? '…'} – {entry.high ?? '…'}
          </Fact>
        )}
        {entry.unit && <Fact name={t('entry.unit')}>{entry.unit}</Fact>}
        {entry.value && (
          <Fact name={t('entry.raw')}>
            <code>{entry.value.raw || '–'}</code>
          </Fact>
        )}
        <Fact name={t('entry.group')}>{entry.group}</Fact>
      </dl>
      {entry.help && <p class="help">{entry.help}</p>}
      {members.length > 1 && <Record members={members} title={entry.object} />}
    </Panel>
  )
}

/** @param {{ node: number, entry: wire.Object, after: () => void }} props */
function Write({ node, entry, after }) {
  const [text, setText] = useState('')
  const [asked, run] = useAsk()
  const write = async (force) => {
    if (await run({ do: 'write', node, address: entry.address, text, force })) after()
  }
  const hasList = entry.choices.length > 0
  return (
    <form class="write" onSubmit={(event) => event.preventDefault()}>
      <Field
        class="grow"
        label={t('entry.new')}
        data-test="object-value"
        list={hasList ? 'choices' : undefined}
        value={text}
        placeholder={entry.value?.is_error ? '' : entry.value?.text}
        autocomplete="off"
        spellcheck={false}
        set={setText}
      >
        {hasList && (
          <datalist id="choices">
            {entry.choices.map((choice) => (
              <option key={choice} value={choice} />
            ))}
          </datalist>
        )}
      </Field>
      <Act
        type="submit"
        class="main"
        data-test="object-write"
        disabled={text.trim() === '' || asked.busy}
        run={() => write(false)}
      >
        {t('entry.write')}
      </Act>
      {entry.default !== null && (
        <Button
          class="quiet"
          data-test="object-default"
          title={t('entry.use-default')}
          run={() => setText(entry.default)}
        >
          {t('entry.default')}
        </Button>
      )}
      {hasList && (
        <div class="chips">
          {entry.choices.map((choice) => (
            <Button key={choice} aria-pressed={choice === text} run={() => setText(choice)}>
              {choice}
            </Button>
          ))}
        </div>
      )}
      <ControlHint />
      {asked.done && (
        <p class="done" role="status" data-test="object-written">
          {t('entry.written')}
        </p>
      )}
      {asked.refused && (
        <>
          <Refusal of={asked.refused} test="object-refusal" />
          <Act class="warn" data-test="object-force" title={t('entry.force.help')} run={() => write(true)}>
            {t('entry.force')}
          </Act>
        </>
      )}
    </form>
  )
}

/** @param {{ members: wire.Object[], title: string }} props */
function Record({ members, title }) {
  return (
    <>
      <h3>{title}</h3>
      <div class="scroll low">
        <table class="grid" data-test="record">
          <tbody>
            {members.map((each) => (
              <tr key={each.address}>
                <td>
                  <code>{each.address}</code>
                </td>
                <td>{each.name}</td>
                <td class={each.value?.is_error ? 'error' : 'value'}>{each.value?.text ?? ''}</td>
              </tr>
            ))}
          </tbody>
        </table>
      </div>
    </>
  )
}
