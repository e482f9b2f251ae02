// What every tab shows: the bus, the connection, who has control, and the stop.
import { send, stop, stopAll } from './bench.js'
import { number, percent } from './format.js'
import { LANGUAGES, language, setLanguage, t } from './i18n/index.js'
import { isHelpOpen } from './keys.jsx'
import { connection, client, hasControl, version, view } from './state.js'
import { nextTheme, theme } from './theme.js'
import { Button, Meter } from './ui.jsx'

export function Header() {
  return (
    <header class="top">
      <div class="always">
        <div class="brand" title={version.value && `lexican ${version.value}`}>
          <img src="icon.svg" alt="" width="26" height="26" />
          <h1>lexican bench</h1>
        </div>
        <BusMark />
        <Connection />
        <Control />
        <div class="settings">
          <Button
            class="quiet"
            data-test="language"
            title={t('language.switch')}
            run={() => setLanguage(otherLanguage())}
          >
            {otherLanguage().toUpperCase()}
          </Button>
          <Button class="quiet" data-test="theme" title={t('theme.switch')} run={nextTheme}>
            {t(`theme.${theme.value}`)}
          </Button>
          <Button class="quiet" data-test="help" title={t('help.title')} run={() => (isHelpOpen.value = true)}>
            ?
          </Button>
        </div>
      </div>
      <Stop />
    </header>
  )
}

const otherLanguage = () => LANGUAGES.find((tag) => tag !== language.value)

/** The kind of mark for the controller's state. Only `error active` is good. */
const kindOf = (state) => (state.endsWith('active') ? 'good' : /off|lost/.test(state) ? 'bad' : 'warn')

function BusMark() {
  const bus = view.bus.value
  return (
    <div class="bus-mark" data-test="bus-mark">
      <b>{bus.name || '…'}</b>
      <span class={`state ${kindOf(bus.state)}`}>{bus.state || t('unknown')}</span>
      {bus.load_percent !== null && (
        <span class="figure">
          <Meter percent={bus.load_percent} label={t('bus.load')} /> {percent(bus.load_percent)}
        </span>
      )}
      <span class="figure">{t('per-second', { count: number(bus.frames_per_second) })}</span>
    </div>
  )
}

function Connection() {
  const { clients } = view.control.value
  const isOpen = connection.value === 'open'
  return (
    <div class="connection" role="status" data-test="connection">
      <span class={`state ${isOpen ? 'good' : 'bad'}`}>{t(`connection.${connection.value}`)}</span>
      {isOpen && <span data-test="clients">{t(clients === 1 ? 'clients.one' : 'clients', { count: clients })}</span>}
    </div>
  )
}

function Control() {
  const { holder } = view.control.value
  if (hasControl.value) {
    return (
      <div class="control on">
        <span role="status">{t('control.mine')}</span>
        <Button data-test="release-control" run={() => send({ do: 'release-control' })}>
          {t('control.release')}
        </Button>
      </div>
    )
  }
  return (
    <div class="control">
      <span role="status">
        {holder === null ? t('control.free') : t('control.theirs', { holder, client: client.value })}
      </span>
      {holder === null ? (
        <Button
          class="main"
          data-test="take-control"
          disabled={!view.bus.value.is_writable}
          run={() => send({ do: 'take-control', force: false })}
        >
          {t('control.take')}
        </Button>
      ) : (
        <Button
          class="warn"
          data-test="take-control"
          title={t('control.force.help')}
          run={() => send({ do: 'take-control', force: true })}
        >
          {t('control.force')}
        </Button>
      )}
    </div>
  )
}

/** Stops when the button is pressed, not when it is released. The key for it is in keys.jsx. */
function Stop() {
  const last = stop.value
  return (
    <div class="stop">
      <button
        type="button"
        data-test="stop-all"
        aria-keyshortcuts="Escape"
        onPointerDown={stopAll}
        onClick={(event) => event.detail === 0 && stopAll()}
      >
        <b>STOP</b>
        <kbd>Esc</kbd>
      </button>
      <span class={`stop-answer ${last?.state ?? ''}`} role="alert" data-test="stop-answer">
        {last && last.state !== 'past' && t(`stop.${last.state}`, { ms: number(last.ms), why: last.why })}
      </span>
    </div>
  )
}
