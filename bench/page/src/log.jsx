// The time of a recorded log.
import { order } from './bench.js'
import { clock } from './format.js'
import { t } from './i18n/index.js'
import { view } from './state.js'
import { Button } from './ui.jsx'

const SPEEDS = [0.1, 1, 10, 100]

export function LogSlider() {
  const { seconds, position, speed } = view.log.value
  const play = (next) => order({ do: 'play', speed: next })
  return (
    <div class="log" role="group" aria-label={t('log')}>
      <Button data-test="log-play" class="main" run={() => play(speed === 0 ? 1 : 0)}>{t(speed === 0 ? 'log.play' : 'log.hold')}</Button>
      <input type="range" data-test="log-position" aria-label={t('log.position')} aria-valuetext={clock(position)} min="0" max={seconds} step="any" value={position} onInput={(event) => order({ do: 'seek', seconds: Number(event.target.value) })} />
      <output>{clock(position)} / {clock(seconds)}</output>
      <div class="choice" role="group" aria-label={t('log.speed')}>
        {SPEEDS.map((each) => (
          <Button key={each} aria-pressed={speed === each} run={() => play(each)}>×{each}</Button>
        ))}
      </div>
    </div>
  )
}
