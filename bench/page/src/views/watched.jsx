// Values that are read again and again.
import { send } from '../bench.js'
import { measured, number } from '../format.js'
import { t } from '../i18n/index.js'
import { view } from '../state.js'
import { Age, Button, Empty, isOld, Panel } from '../ui.jsx'

export function Watched() {
  const watched = view.watched.value
  return (
    <Panel title={t('watch.title')}>
      {watched.length === 0 ? (
        <Empty>{t('watch.none')}</Empty>
      ) : (
        <div class="scroll low">
          <table class="grid" data-test="watch-list">
            <thead>
              <tr>
                <th class="number">{t('node')}</th>
                <th>{t('entry.name')}</th>
                <th>{t('entry.value')}</th>
                <th class="number">{t('watch.bounds')}</th>
                <th class="number">{t('watch.changes')}</th>
                <th />
              </tr>
            </thead>
            <tbody>
              {watched.map((each) => (
                <tr key={`${each.node} ${each.address}`} data-test={`watched-${each.node}-${each.address}`}>
                  <td class="number">{each.node}</td>
                  <td title={t('watch.every', { ms: each.every_ms })}>
                    <code>{each.address}</code> {each.name}
                  </td>
                  <td class={each.value?.is_error ? 'error' : isOld(each.seen) ? 'value old' : 'value'}>
                    {each.value?.text ?? '…'} <Age seen={each.seen} />
                  </td>
                  <td class="number">{each.bounds && `${measured(each.bounds[0])} … ${measured(each.bounds[1])}`}</td>
                  <td class="number">{number(each.changes)}</td>
                  <td>
                    <Button
                      class="quiet"
                      title={t('entry.unwatch')}
                      aria-label={t('entry.unwatch')}
                      run={() => send({ do: 'unwatch', node: each.node, address: each.address })}
                    >
                      ×
                    </Button>
                  </td>
                </tr>
              ))}
            </tbody>
          </table>
        </div>
      )}
    </Panel>
  )
}
