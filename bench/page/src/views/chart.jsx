// uPlot, kept in step with the curves: an axis per unit, zoom by drag, wheel and keys, cursors by click.
import { useEffect, useRef } from 'preact/hooks'
import uPlot from 'uplot'
import { keyOf } from '../curves.js'
import { measured } from '../format.js'
import { t } from '../i18n/index.js'
import { isDark } from '../theme.js'
import { useResize } from '../ui.jsx'

/** The value of a CSS variable with a colour, for a canvas: it is resolved only where an element uses it. */
function color(name) {
  const probe = /** @type {HTMLElement} */ (document.querySelector('.chart'))
  probe.style.color = `var(${name})`
  const { color } = getComputedStyle(probe)
  probe.style.color = ''
  return color
}

const scaleOf = (curve) => curve.unit ?? '-'

/** The width of an axis for its numbers, in px. */
const widthOf = (_, numbers) => 28 + 8 * Math.max(3, ...(numbers ?? []).map((text) => text.length))

/** `colors` has the colour of each curve, which stays the same when another curve is hidden. */
function options(curves, colors, size, hooks) {
  const units = [...new Set(curves.map(scaleOf))]
  /** An axis with only one curve has the colour of that curve. */
  const strokeOf = (unit) => {
    const of = curves.filter((curve) => scaleOf(curve) === unit)
    return of.length === 1 ? color(colors.get(keyOf(of[0]))) : text
  }
  const [text, grid] = [color('--text-soft'), color('--line-soft')]
  const axis = {
    stroke: text,
    grid: { stroke: grid, width: 1 },
    ticks: { stroke: grid, width: 1 },
    font: '12px system-ui, sans-serif',
    labelFont: '12px system-ui, sans-serif',
  }
  return {
    ...size,
    legend: { show: false },
    cursor: { drag: { x: true, y: false, setScale: false }, points: { size: 7 } },
    scales: { x: { time: false, auto: false }, ...Object.fromEntries(units.map((unit) => [unit, { auto: true }])) },
    axes: [
      { ...axis, values: (_, splits) => splits.map((each) => `${+each.toFixed(3)} s`) },
      ...units.map((unit, place) => ({
        ...axis,
        stroke: strokeOf(unit),
        scale: unit,
        values: (_, splits) => splits.map((each) => measured(each)),
        label: unit === '-' ? '' : unit,
        side: place % 2 === 0 ? 3 : 1,
        size: widthOf,
        labelSize: 18,
        grid: { ...axis.grid, show: place === 0 },
      })),
    ],
    series: [
      {},
      ...curves.map((curve) => ({
        label: curve.name,
        scale: scaleOf(curve),
        stroke: color(colors.get(keyOf(curve))),
        width: 1.5,
        points: { show: false },
        paths: uPlot.paths.stepped({ align: 1 }),
      })),
    ],
    hooks,
  }
}

export function Chart({ curves, colors, data, sight, cursors, setRange, setCursor }) {
  const element = useRef(null)
  const plot = useRef(null)
  const latest = useRef(null)
  latest.current = { sight, cursors, setRange, setCursor }
  const kind = curves.map((curve) => `${keyOf(curve)} ${scaleOf(curve)}`).join()

  const size = () => ({ width: element.current.clientWidth, height: Math.max(160, element.current.clientHeight) })
  useEffect(() => {
    const hooks = {
      draw: [(chart) => drawCursors(chart, latest.current.cursors)],
      setSelect: [
        (chart) => {
          const { left, width } = chart.select
          if (width > 4) latest.current.setRange([chart.posToVal(left, 'x'), chart.posToVal(left + width, 'x')])
          chart.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false)
        },
      ],
    }
    const chart = new uPlot(options(curves, colors, size(), hooks), data, element.current)
    plot.current = chart
    chart.setScale('x', { min: sight[0], max: sight[1] })
    let pressed = null
    chart.over.addEventListener('pointerdown', (event) => (pressed = event.clientX))
    chart.over.addEventListener('pointerup', (event) => {
      if (pressed !== null && Math.abs(event.clientX - pressed) < 4)
        latest.current.setCursor(chart.posToVal(event.offsetX, 'x'))
      pressed = null
    })
    chart.over.addEventListener('dblclick', () => latest.current.setRange(null))
    chart.over.addEventListener(
      'wheel',
      (event) => {
        event.preventDefault()
        zoom(event.deltaY > 0 ? 1.25 : 0.8, chart.posToVal(event.offsetX, 'x'))
      },
      { passive: false },
    )
    return () => chart.destroy()
  }, [kind, isDark.value])
  useResize(element, () => plot.current?.setSize(size()))
  useEffect(() => {
    const chart = plot.current
    chart.batch(() => {
      chart.setData(data, false)
      chart.setScale('x', { min: sight[0], max: sight[1] })
    })
    chart.redraw(false, false)
  }, [data, sight[0], sight[1], cursors])

  const zoom = (factor, center) => {
    const [from, to] = latest.current.sight
    latest.current.setRange([center - (center - from) * factor, center + (to - center) * factor])
  }
  const keys = (event) => {
    const [from, to] = latest.current.sight
    const pan = { ArrowLeft: -0.1, ArrowRight: 0.1 }[event.key]
    if (pan) setRange([from + pan * (to - from), to + pan * (to - from)])
    else if (event.key === '+') zoom(0.8, (from + to) / 2)
    else if (event.key === '-') zoom(1.25, (from + to) / 2)
    else if (event.key === '0') setRange(null)
    else if (event.key === 'Enter') setCursor((from + to) / 2)
    else return
    event.preventDefault()
    event.stopPropagation()
  }
  return (
    <div
      ref={element}
      class="chart"
      tabindex={0}
      role="img"
      aria-label={`${t('plots.title')}: ${curves.map((curve) => curve.name).join(', ')}`}
      data-test="chart"
      onKeyDown={keys}
    />
  )
}

function drawCursors(chart, cursors) {
  const { ctx, bbox } = chart
  cursors.forEach((time, place) => {
    if (time === null) return
    const x = Math.round(chart.valToPos(time, 'x', true))
    if (x < bbox.left || x > bbox.left + bbox.width) return
    ctx.save()
    ctx.strokeStyle = ctx.fillStyle = color('--accent')
    ctx.setLineDash([6, 4])
    ctx.beginPath()
    ctx.moveTo(x, bbox.top)
    ctx.lineTo(x, bbox.top + bbox.height)
    ctx.stroke()
    ctx.font = `${12 * devicePixelRatio}px system-ui, sans-serif`
    ctx.fillText('AB'[place], x + 4 * devicePixelRatio, bbox.top + 12 * devicePixelRatio)
    ctx.restore()
  })
}
