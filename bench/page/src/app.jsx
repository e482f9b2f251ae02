// The page: header with the stop, tabs, the view of the tab that is open.
import { render } from 'preact'
import { useEffect } from 'preact/hooks'
import { connect } from './bench.js'
import { Footer } from './footer.jsx'
import { Header } from './header.jsx'
import { Help, listenToKeys } from './keys.jsx'
import { t, language } from './i18n/index.js'
import { TABS, goTo, tab, view } from './state.js'
import { roving } from './ui.jsx'
import { Bus } from './views/bus.jsx'
import { Devices } from './views/devices.jsx'
import { Drives } from './views/drives.jsx'
import { Nodes } from './views/nodes.jsx'
import { Objects } from './views/objects.jsx'
import { Pdos } from './views/pdos.jsx'
import { Plots } from './views/plots.jsx'
import { Trace } from './views/trace.jsx'
import { LogSlider } from './log.jsx'
import { theme } from './theme.js'

const VIEWS = {
  nodes: Nodes,
  objects: Objects,
  pdos: Pdos,
  trace: Trace,
  plots: Plots,
  drives: Drives,
  bus: Bus,
  devices: Devices,
}

/** The number of things in a tab that need attention. */
function badge(name) {
  if (name === 'nodes')
    return view.nodes.value.filter((node) => node.faults.length > 0 || node.silent_seconds !== null).length
  if (name === 'bus') return view.bus.value.troubles.length
  return 0
}

function Tabs() {
  return (
    <nav class="tabs" aria-label={t('tabs')}>
      <div role="tablist" aria-label={t('tabs')} onKeyDown={roving}>
        {TABS.map((name, index) => {
          const count = badge(name)
          const isOpen = tab.value === name
          return (
            <button
              key={name}
              type="button"
              role="tab"
              id={`tab-${name}`}
              data-test={`tab-${name}`}
              data-roving
              aria-selected={isOpen}
              aria-controls="view"
              tabindex={isOpen ? 0 : -1}
              title={`${t(`tab.${name}`)} (${index + 1})`}
              onClick={() => goTo(name)}
            >
              {t(`tab.${name}`)}
              {count > 0 && (
                <span class="badge" aria-label={t('tab.badge', { count })}>
                  {count}
                </span>
              )}
            </button>
          )
        })}
      </div>
    </nav>
  )
}

function App() {
  const View = VIEWS[tab.value]
  useEffect(listenToKeys, [])
  useEffect(() => {
    document.documentElement.lang = language.value
    document.documentElement.dataset.theme = theme.value
    document.title = `${view.bus.value.name || 'bench'} · ${t(`tab.${tab.value}`)} · lexican`
  }, [language.value, theme.value, tab.value, view.bus.value.name])
  return (
    <>
      <Header />
      <Tabs />
      {view.log.value && <LogSlider />}
      <main>
        <div id="view" role="tabpanel" aria-labelledby={`tab-${tab.value}`} class={`view-${tab.value}`}>
          <View />
        </div>
      </main>
      <Footer />
      <Help />
    </>
  )
}

connect()
render(<App />, document.getElementById('app'))
