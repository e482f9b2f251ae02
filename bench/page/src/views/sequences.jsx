// Records what is done as a sequence, and plays sequences of the machine or from files.
import { useState } from 'preact/hooks'
import { send, sendForFile } from '../bench.js'
import { fileText } from '../files.js'
import { t } from '../i18n/index.js'
import { view } from '../state.js'
import { Act, Button, Panel } from '../ui.jsx'

export function Sequences() {
  const { sequences, messages, recorded: count } = view.kept.value
  const isRecorded = count !== null
  const record = () => (isRecorded ? sendForFile({ do: 'record', on: false }) : send({ do: 'record', on: true }))
  const [picked, setPicked] = useState([])
  const pick = async ({ currentTarget: { files } }) =>
    setPicked(await Promise.all([...files].map(async (file) => ({ name: file.name, text: await fileText(file) }))))
  return (
    <Panel title={t('sequences.title')}>
      <div class="line">
        <Button data-test="record" aria-pressed={isRecorded} run={record}>
          {t(isRecorded ? 'sequences.end' : 'sequences.record', { count })}
        </Button>
        {messages.map((name) => (
          <Act key={name} data-test={`message-${name}`} run={() => send({ do: 'play-sequence', name, text: null })}>
            {name}
          </Act>
        ))}
        {[...sequences.map((name) => ({ name, text: null })), ...picked].map(({ name, text }) => (
          <Act
            key={name}
            data-test={`play-${name}`}
            title={t('sequences.play')}
            run={() => sendForFile({ do: 'play-sequence', name, text })}
          >
            ▶ {name}
          </Act>
        ))}
        <label class="field">
          <span>{t('sequences.file')}</span>
          <input type="file" data-test="sequence" onChange={pick} />
        </label>
      </div>
    </Panel>
  )
}
