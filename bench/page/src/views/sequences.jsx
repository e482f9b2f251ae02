// What is done becomes a sequence; those of the machine, and files, are played.
import { send, sendForFile } from '../bench.js'
import { fileText } from '../files.js'
import { t } from '../i18n/index.js'
import { view } from '../state.js'
import { Act, Button, Panel } from '../ui.jsx'

const play = (name, text = null) => sendForFile({ do: 'play-sequence', name, text })

export function Sequences() {
  const { sequences, recorded: count } = view.kept.value
  const isRecorded = count !== null
  const record = () => (isRecorded ? sendForFile({ do: 'record', on: false }) : send({ do: 'record', on: true }))
  const pick = async ({ currentTarget: input }) => {
    const [file] = input.files
    if (file) await play(file.name, await fileText(file))
    input.value = '' // It may be picked again.
  }
  return (
    <Panel title={t('sequences.title')}>
      <div class="line">
        <Button data-test="record" aria-pressed={isRecorded} run={record}>
          {t(isRecorded ? 'sequences.end' : 'sequences.record', { count })}
        </Button>
        {sequences.map((name) => (
          <Act key={name} data-test={`play-${name}`} title={t('sequences.play')} run={() => play(name)}>
            ▶ {name}
          </Act>
        ))}
        <label class="field">
          <span>{t('sequences.play')}</span>
          <input type="file" data-test="sequence" onChange={pick} />
        </label>
      </div>
    </Panel>
  )
}
