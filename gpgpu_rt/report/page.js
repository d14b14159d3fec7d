"use strict"
// This script folds the table of contents in a narrow window, marks the chapter in view, and plays
// the films. The page also works without the script.

const still = matchMedia("(prefers-reduced-motion: reduce)")
const FRAME_MS = 120, LAST_MS = 1500

function contents() {
  const list = document.querySelector("#contents details")
  const wide = matchMedia("(min-width: 64rem)")
  const fold = () => { list.open = wide.matches }
  fold()
  wide.addEventListener("change", fold)
  list.addEventListener("click", event => {
    if (event.target.matches("a") && !wide.matches) list.open = false
  })
  const links = new Map([...list.querySelectorAll("a")].map(link => [link.hash.slice(1), link]))
  const heads = [...links.keys()].map(id => document.getElementById(id))
  const mark = () => {
    const passed = heads.filter(head => head.getBoundingClientRect().top < innerHeight / 3)
    for (const link of links.values()) link.removeAttribute("aria-current")
    if (passed.length) links.get(passed.at(-1).id).setAttribute("aria-current", "true")
  }
  addEventListener("scroll", mark, { passive: true })
  mark()
}

function film(figure) {
  const frames = JSON.parse(figure.dataset.frames)
  const picture = figure.querySelector(".screen img")
  const button = figure.querySelector("button"), slider = figure.querySelector("input")
  let timer = 0
  const show = at => {
    slider.value = at
    slider.setAttribute("aria-valuetext", frames[at])
    picture.style.transform = `translateY(${-100 * at / frames.length}%)`
    figure.querySelector(".state").textContent = frames[at]
  }
  const pause = () => {
    clearTimeout(timer)
    timer = 0
    button.textContent = "Play"
  }
  const step = () => {
    const next = (Number(slider.value) + 1) % frames.length
    show(next)
    timer = setTimeout(step, next === frames.length - 1 ? LAST_MS : FRAME_MS)
  }
  const play = () => {
    if (timer) return
    timer = setTimeout(step, FRAME_MS)
    button.textContent = "Pause"
  }
  let chosen = false      // whether the reader has chosen to play or to pause
  button.addEventListener("click", () => {
    chosen = true
    if (timer) pause()
    else play()
  })
  slider.addEventListener("input", () => {
    chosen = true
    pause()
    show(Number(slider.value))
  })
  new IntersectionObserver(([entry]) => {
    if (!entry.isIntersecting) pause()
    else if (!chosen && !still.matches) play()
  }, { threshold: 0.6 }).observe(figure.querySelector(".screen"))
  still.addEventListener("change", () => { if (still.matches) pause() })
  figure.querySelector(".controls").hidden = false
  show(Number(slider.value))
}

contents()
document.querySelectorAll("figure.film").forEach(film)
