// All parameters of a node: differences, backup, restore.
import { useState } from 'preact/hooks'
import { fileText, save } from '../files.js'
import { t } from '../i18n/index.js'
import { view } from '../state.js'
import { Act, Button, Choice, Empty, named, Panel, Refusal, useAsk } from '../ui.jsx'

/** @import * as wire from '../wire' */

export function Parameters({ node, show }) {
  const [asked, run] = useAsk()
  const [differences, setDifferences] = useState(null)
  const [dcf, setDcf] = useState(null)
  const compare = async (other) => {
    setDifferences(null)
    const found = await run({ do: 'compare', node, with: other })
    setDifferences(found)
  }
  const backup = async () => {
    const file = await run({ do: 'backup', node })
    if (file) save(file)
  }
  const pick = async (event) => {
    const [file] = event.target.files
    setDcf(file ? { name: file.name, text: await fileText(file) } : null)
  }
  const others = view.nodes.value.filter((each) => each.id !== node)
  return (
    <Panel title={t('parameters.title')} data-test="parameters">
      <div class="line">
        <Button data-test="backup" aria-disabled={asked.busy} run={backup}>
          {t('backup')}
        </Button>
        <Button data-test="compare-defaults" run={() => compare('defaults')}>
          {t('compare.defaults')}
        </Button>
        <Choice
          label={t('compare.node')}
          data-test="compare-node"
          value=""
          options={[['', '…'], ...named(others)]}
          set={(id) => id && compare({ node: Number(id) })}
        />
      </div>
      <div class="line">
        <label class="field grow">
          <span>{t('dcf')}</span>
          <input type="file" data-test="dcf" accept=".dcf,.eds,.txt" onChange={pick} />
        </label>
        <Button data-test="compare-dcf" disabled={!dcf} run={() => compare({ dcf: dcf.text })}>
          {t('compare.dcf')}
        </Button>
        <Act
          class="main"
          data-test="restore"
          disabled={!dcf}
          title={t('restore.help')}
          run={() => run({ do: 'restore', node, dcf: dcf.text })}
        >
          {t('restore')}
        </Act>
      </div>
      <Refusal of={asked.refused} test="parameters-refusal" />
      {asked.busy && (
        <p class="hint" role="status">
          {t('working')}
        </p>
      )}
      {differences?.length === 0 && <Empty>{t('compare.same')}</Empty>}
      {differences?.length > 0 && <Differences differences={differences} show={show} />}
    </Panel>
  )
}

/** @param {{ differences: wire.Difference[], show: (address: string) => void }} props */
function Differences({ differences, show }) {
  return (
    <div class="scroll low">
      <table class="grid" data-test="differences">
        <thead>
          <tr>
            <th>{t('entry.address')}</th>
            <th>{t('entry.name')}</th>
            <th>{t('compare.here')}</th>
            <th>{t('compare.there')}</th>
          </tr>
        </thead>
        <tbody>
          {differences.map((each) => (
            <tr key={each.address}>
              <td>
                <Button class="link" run={() => show(each.address)}>
                  {each.address}
                </Button>
              </td>
              <td>{each.name}</td>
              <td class="value">{each.here}</td>
              <td class="value">{each.there}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  )
}
