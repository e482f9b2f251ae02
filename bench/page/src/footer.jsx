// The line at the bottom: jobs in progress, the last refusal, a lost connection.
import { refusal } from './bench.js'
import { t } from './i18n/index.js'
import { connection, view } from './state.js'
import { Button, Meter, Refusal } from './ui.jsx'

/** @import * as wire from './wire' */

/** The text for each state of a lost connection. */
const LOSSES = { lost: 'lost', ended: 'ended', refused: 'forbidden' }

export function Footer() {
  return (
    <footer>
      {connection.value in LOSSES && (
        <p class="lost" role="alert" data-test="lost">
          <strong>{t(LOSSES[connection.value])}</strong> {t(`${LOSSES[connection.value]}.what`)}
        </p>
      )}
      {refusal.value && (
        <div class="last-refusal">
          <Refusal of={refusal.value} test="refusal" />
          <Button class="quiet" run={() => (refusal.value = null)}>
            {t('close')}
          </Button>
        </div>
      )}
      <p class="unseen" aria-live="polite">
        {view.bus.value.troubles.at(-1)?.text}
      </p>
      <ul class="jobs" aria-label={t('jobs')} aria-live="polite" data-test="jobs">
        {view.jobs.value.slice(-4).map((job) => (
          <Job key={job.number} job={job} />
        ))}
      </ul>
    </footer>
  )
}

/** @param {{ job: wire.Job }} props */
function Job({ job }) {
  const kind = job.is_success === null ? 'running' : job.is_success ? 'good' : 'bad'
  return (
    <li class={`job ${kind}`} data-test={`job-${job.number}`}>
      <b>{job.name}</b>
      {job.is_success === null && <Meter percent={(job.done ?? 0) * 100} alarm={101} label={job.name} />}
      <span>{job.text}</span>
    </li>
  )
}
