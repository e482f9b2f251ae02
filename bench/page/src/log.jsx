// The playback time of a recorded log.
import { useEffect, useRef, useState } from 'preact/hooks'
import { send } from './bench.js'
import { clock } from './format.js'
import { t } from './i18n/index.js'
import { view } from './state.js'
import { Button } from './ui.jsx'

const SPEEDS = [0.1, 1, 10, 100]

/**
 * Seeks one at a time; when one is done, the next goes to where the slider is by then. The slider stays there until the
 * view has the new position, which may come after the answer.
 */
function useSeek(position) {
  const [wanted, setWanted] = useState(null)
  const latest = useRef({ wanted: null, isBusy: false, before: position })
  useEffect(() => {
    if (!latest.current.isBusy) setWanted(null)
  }, [position])
  const seek = async (seconds) => {
    setWanted(seconds)
    latest.current.wanted = seconds
    if (latest.current.isBusy) return
    latest.current.isBusy = true
    latest.current.before = view.log.value.position
    while (latest.current.wanted !== null) {
      const next = latest.current.wanted
      latest.current.wanted = null
      await send({ do: 'seek', seconds: next })
    }
    latest.current.isBusy = false
    if (view.log.value.position !== latest.current.before) setWanted(null)
  }
  return [wanted, seek]
}

export function LogSlider() {
  const { seconds, position, speed } = view.log.value
  const [wanted, seek] = useSeek(position)
  const play = (next) => send({ do: 'play', speed: next })
  return (
    <div class="log" role="group" aria-label={t('log')}>
      <Button data-test="log-play" class="main" run={() => play(speed === 0 ? 1 : 0)}>
        {t(speed === 0 ? 'log.play' : 'log.hold')}
      </Button>
      <input
        type="range"
        data-test="log-position"
        aria-label={t('log.position')}
        aria-valuetext={clock(position)}
        min="0"
        max={seconds}
        step="any"
        value={wanted ?? position}
        onInput={(event) => seek(Number(event.currentTarget.value))}
      />
      <output>
        {clock(position)} / {clock(seconds)}
      </output>
      <div class="choice" role="group" aria-label={t('log.speed')}>
        {SPEEDS.map((each) => (
          <Button key={each} aria-pressed={speed === each} run={() => play(each)}>
            ×{each}
          </Button>
        ))}
      </div>
    </div>
  )
}
