// Keys: the stop first, then navigation. `?` lists them.
import { signal } from '@preact/signals'
import { send, stopAll } from './bench.js'
import { t } from './i18n/index.js'
import { TABS, goTo, hasControl } from './state.js'
import { Dialog } from './ui.jsx'

export const isHelpOpen = signal(false)

const isTyping = (target) => target.closest?.('input, select, textarea, [contenteditable]') !== null

/** The action of a key as a function; null if it has none. */
function deed(event) {
  if (event.ctrlKey || event.altKey || event.metaKey || isTyping(event.target)) return null
  const tab = TABS[Number(event.key) - 1]
  if (tab) return () => goTo(tab)
  const searches = /** @type {HTMLInputElement | null} */ (document.querySelector('main input[type=search]'))
  if (event.key === '/' && searches) return () => searches.focus()
  if (event.key === '?') return () => (isHelpOpen.value = true)
  if (event.key === 'h')
    return () => send(hasControl.value ? { do: 'release-control' } : { do: 'take-control', force: false })
  return null
}

export function listenToKeys() {
  // In the capture phase, so that nothing on the page can keep the stop key to itself.
  const stop = (event) => {
    if (event.key === 'Escape' && !event.repeat) stopAll()
  }
  const others = (event) => {
    const run = event.defaultPrevented ? null : deed(event)
    if (!run) return
    event.preventDefault()
    run()
  }
  window.addEventListener('keydown', stop, { capture: true })
  window.addEventListener('keydown', others)
  return () => {
    window.removeEventListener('keydown', stop, { capture: true })
    window.removeEventListener('keydown', others)
  }
}

const KEYS = [
  ['Esc', 'keys.stop'],
  [`1 – ${TABS.length}`, 'keys.tabs'],
  ['/', 'keys.search'],
  ['h', 'keys.control'],
  ['?', 'keys.help'],
  ['↑ ↓ Home End', 'keys.rows'],
  ['← →', 'keys.tree'],
  ['Space', 'keys.hold'],
  ['PgUp PgDn', 'keys.pages'],
  ['Alt ← →', 'keys.move'],
  ['Del', 'keys.remove'],
  ['+ −  ← →  0', 'keys.plot'],
]

export function Help() {
  return (
    <Dialog
      open={isHelpOpen.value}
      close={() => (isHelpOpen.value = false)}
      title={t('help.title')}
      data-test="help-dialog"
    >
      <dl class="keys">
        {KEYS.map(([key, text]) => (
          <div key={key}>
            <dt>
              <kbd>{key}</kbd>
            </dt>
            <dd>{t(text)}</dd>
          </div>
        ))}
      </dl>
      <p class="hint">{t('help.stop')}</p>
    </Dialog>
  )
}
